"""Ways to break a file, by its format: each yields (name, content). The same file gives the same ones in every run."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any
from xml.etree import ElementTree

import numpy as np
import yaml

Broken = Iterator[tuple[str, bytes]]
Mutation = Callable[[bytes], Broken]

SCRIPT = "<script>alert(1)</script>"
ESCAPE = "\x1b[31mred\x1b]0;title\x07"
MARKUP = "[/red] [bold]b"
ODD_TEXTS = {
    "script": SCRIPT,
    "escape": ESCAPE,
    "markup": MARKUP,
    "format": "{0}{x}%s%(x)s",
    "surrogate": "\u202e\ufeff☃",
}
NUMBERS = {
    "zero": "0",
    "minus": "-1",
    "huge": "1e308",
    "minus_huge": "-1e308",
    "infinite": "1e999",
    "tiny": "1e-308",
    "nan": ".nan",
}
NUMBERS |= {
    "int64": str(2**63),
    "digits": "9" * 5000,
    "octal": "0o9",
    "hexadecimal": "0xZZ",
    "long_hexadecimal": "0x" + "f" * 5000,
}


def by_bytes(content: bytes) -> Broken:
    """Whatever the format: cuts, foreign bytes, other encodings and ends of lines."""
    yield "empty", b""
    yield "blank", b" \n\n"
    yield "one_byte", content[:1]
    yield "half", content[: len(content) // 2]
    yield "all_but_one", content[:-1]
    yield "twice", content + content
    yield "zeros", bytes(1000)
    yield "nul_inside", content[: len(content) // 2] + b"\0" + content[len(content) // 2 :]
    yield "latin_1", content[: len(content) // 2] + "Käse".encode("latin-1") + content[len(content) // 2 :]
    yield "utf_16", b"\xff\xfe" + content.decode("latin-1").encode("utf-16-le")
    yield "utf_8_with_mark", b"\xef\xbb\xbf" + content
    yield "cr_only", content.replace(b"\n", b"\r")
    yield "crlf", content.replace(b"\n", b"\r\n")
    yield "form_feeds", content.replace(b"\n", b"\x0c\n")
    yield "one_line", content.replace(b"\n", b" ")
    yield "a_program", b"\x7fELF\x02\x01\x01" + bytes(range(256)) * 8
    yield "a_zip", b"PK\x03\x04" + bytes(range(256)) * 4
    yield "json", b'{"a": [1, 2, {"b": null}]}'
    for seed in range(6):
        chance = random.Random(seed)
        changed = bytearray(content)
        for _ in range(1 + len(changed) // 100):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
        yield f"bytes_{seed}", bytes(changed)
    for seed in range(6):
        chance = random.Random(seed)
        first, second = sorted(chance.randrange(len(content)) for _ in range(2))
        yield f"moved_{seed}", content[second:] + content[first:second] + content[:first]


def by_yaml_text(content: bytes) -> Broken:
    """YAML as text: depth, aliases, numbers, tags."""
    text = content.decode()
    for depth in (500, 100_000):
        yield f"lists_{depth}_deep", f"{text}deep: {'[' * depth}{']' * depth}\n".encode()
        yield f"mappings_{depth}_deep", f"{text}deep: {'{a: ' * depth}1{'}' * depth}\n".encode()
        yield f"open_lists_{depth}_deep", (text + "deep: " + "[" * depth).encode()
        yield f"dashes_{depth}_deep", (text + "deep:\n" + "- " * depth + "1\n").encode()
    levels = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 10)}]\n" for k in range(12))
    yield "alias_bomb", ("a0: &a0 [1]\n" + levels + text).encode()
    nested = "".join(f"a{k + 1}: &a{k + 1} {{x: *a{k}, y: *a{k}}}\n" for k in range(60))
    yield "alias_mappings", ("a0: &a0 {x: 1}\n" + nested + text).encode()
    yield "alias_to_itself", (text + "self: &self [*self]\n").encode()
    yield "unknown_alias", (text + "self: *nobody\n").encode()
    yield "merge_key", ("base: &base {x: 1}\n" + text + "merged: {<<: *base}\n").encode()
    yield "tag_python", (text + "run: !!python/object/apply:os.system ['true']\n").encode()
    yield "tag_own", (text + "run: !ours {a: 1}\n").encode()
    yield "tag_int", (text + "n: !!int abc\n").encode()
    yield "tag_binary", (text + "n: !!binary AAAA\n").encode()
    yield "two_documents", (text + "---\n" + text).encode()
    yield "directive", ("%YAML 3.7\n---\n" + text).encode()
    yield "tabs", text.replace("  ", "\t").encode()
    yield "key_list", (text + "? [a, b]\n: 1\n").encode()
    yield "key_null", (text + "~: 1\n").encode()
    yield "key_script", (text + f'"{SCRIPT}": 1\n').encode()
    yield "key_escape", (text + '"\\e[31mred\\a": 1\n').encode()
    yield "key_markup", (text + f'"{MARKUP}": 1\n').encode()
    yield "key_megabyte", (text + f"{'k' * 1_000_000}: 1\n").encode()
    yield "keys_many", (text + "".join(f"k{i}: {i}\n" for i in range(20_000))).encode()
    yield "value_megabyte", (text + f"k: {'v' * 1_000_000}\n").encode()
    yield "a_list", b"- 1\n- 2\n"
    yield "a_number", b"17\n"
    yield "a_text", b"text\n"
    yield "null", b"null\n"


def by_yaml_structure(content: bytes) -> Broken:
    """Every value of a YAML file replaced, removed and repeated."""
    data = yaml.safe_load(content)
    for path in _paths(data):
        name = "_".join(map(str, path))
        for label, changed in _replaced(data, path):
            yield f"{name}_{label}", changed


def by_numbers(content: bytes) -> Broken:
    """Every number of a text replaced by one that cannot be."""
    text = content.decode()
    places = list(re.finditer(r"(?<![\w.])-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])", text))
    for k, place in enumerate(places[:: max(1, len(places) // 12)]):
        for label, number in NUMBERS.items():
            yield f"number_{k}_{label}", (text[: place.start()] + number + text[place.end() :]).encode()


def by_cells(content: bytes, separator: str = ",") -> Broken:
    """Cells, columns and rows of a table with a header."""
    rows = [line.split(separator) for line in content.decode("cp1252").splitlines()]
    head = next(k for k, row in enumerate(rows) if len(row) > 1 and row[1])

    def joined(table: list[list[str]]) -> bytes:
        return ("\n".join(separator.join(row) for row in table) + "\n").encode()

    texts = (
        ODD_TEXTS
        | NUMBERS
        | {"missing": "", "word": "abc", "nan_word": "nan", "infinity": "Infinity", "underscore": "1_000"}
    )
    texts |= {
        "comma": '"1,5"',
        "quote": '"',
        "quoted_line": '"1\n2"',
        "megabyte": "1" * 1_000_000,
        "megabyte_text": "x" * 1_000_000,
    }
    texts |= {
        "spaces": "  1 ",
        "arabic": "١٢",
        "boolean": "true",
        "date": "2026-01-01",
        "nul": "\0",
        "int64_edge": str(2**63 - 1),
    }
    texts |= {
        "half": "0.5",
        "float53": "9007199254740993",
        "minus_int64": str(-(2**63) - 1),
        "float_int": "1e18",
        "sign": "+-1",
    }
    width = len(rows[head])
    for column in range(width):
        for label, text in texts.items():
            for line in (head + 1, len(rows) - 1):
                changed = deepcopy(rows)
                changed[line][column] = text
                if line == head + 1 or label in ("missing", "word", "huge"):
                    yield f"line_{line}_column_{column}_{label}", joined(changed)
        for label, text in texts.items():
            changed = [
                [*row[:column], text, *row[column + 1 :]] if k > head and len(row) > column else row
                for k, row in enumerate(rows)
            ]
            if label in ("zero", "huge", "minus_huge", "int64", "tiny", "word", "missing", "escape"):
                yield f"column_{column}_all_{label}", joined(changed)
        for label, text in {
            **ODD_TEXTS,
            "empty": "",
            "same": rows[head][0],
            "megabyte": "h" * 1_000_000,
            "quote": '"',
        }.items():
            changed = deepcopy(rows)
            changed[head][column] = text
            yield f"header_{column}_{label}", joined(changed)
        yield f"without_{column}", joined([row[:column] + row[column + 1 :] for row in rows])
        yield f"twice_{column}", joined([[*row, *row[column : column + 1]] for row in rows])
    yield "no_rows", joined(rows[: head + 1])
    yield "one_row", joined(rows[: head + 2])
    yield "two_rows", joined(rows[: head + 3])
    yield "no_header", joined(rows[head + 1 :])
    yield "reversed", joined([*rows[: head + 1], *rows[:head:-1]])
    yield "same_rows", joined([*rows[: head + 1], *[rows[head + 1]] * 20])
    yield "ragged", joined([row[: 1 + k % width] if k > head else row for k, row in enumerate(rows)])
    yield "blank_line", joined([*rows[: head + 2], [""], *rows[head + 2 :]])
    yield "comment_line", joined([*rows[: head + 2], ["# note"], *rows[head + 2 :]])
    yield (
        "columns_1000",
        joined([[*row, *[f"c{i}" if k == head else "1" for i in range(1000)]] for k, row in enumerate(rows)]),
    )
    yield "semicolons", content.replace(b",", b";")
    yield "tabs", content.replace(separator.encode(), b"\t")
    yield (
        "transposed",
        joined([[row[k] if k < len(row) else "" for row in rows[head:]] for k in range(width)]),
    )


def by_xml(content: bytes) -> Broken:
    """Elements and attributes of an XML file, its encoding and entities."""
    text = content.decode()
    for encoding in ("latin-1", "utf-16", "utf-32", "x-unknown", "cp037", "", "ascii", "koi8-r", "shift_jis"):
        yield (
            f"declared_{encoding or 'empty'}",
            text.replace('encoding="UTF-8"', f'encoding="{encoding}"').encode(),
        )
    for encoding in ("utf-16", "utf-32", "latin-1", "cp037", "koi8-r", "shift_jis"):
        declared = text.replace('encoding="UTF-8"', f'encoding="{encoding}"').replace("axis_1", "ось_1")
        yield f"encoded_{encoding}", declared.encode(encoding, "replace")
    body = text.partition("?>")[2]
    bomb = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(12))
    yield (
        "entity_bomb",
        f'<!DOCTYPE robot [<!ENTITY a0 "aaaaaaaaaa">{bomb}]>{body.replace("axis_1", "&a12;")}'.encode(),
    )
    yield (
        "entity_file",
        f'<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>{body.replace("axis_1", "&x;")}'.encode(),
    )
    yield "entity_name", f'<!DOCTYPE robot [<!ENTITY x "axis">]>{body.replace("axis_1", "&x;_1")}'.encode()
    for depth in (500, 100_000):
        yield f"{depth}_deep", body.replace("</robot>", "<a>" * depth + "</a>" * depth + "</robot>").encode()
    yield "comments", body.replace("<link", "<!-- --><link").encode()
    yield "cdata", body.replace("</robot>", "<![CDATA[<a>]]></robot>").encode()
    yield "namespace", body.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ').encode()
    yield "xacro", body.replace("0.45", "${length}").encode()
    yield "link_named_as_joint", body.replace("upper", "axis_2").encode()
    yield "all_one_name", re.sub("axis_[123]|mount|flange", "same", body).encode()
    yield "universe", re.sub("flange", "universe", body).encode()
    for count in (100, 1100):
        links = "".join(f'<link name="l{k}"/>' for k in range(count))
        ends = "".join(
            f'<joint name="j{k}" type="revolute"><parent link="{"flange" if k == 0 else f"l{k - 1}"}"/><child link="l{k}"/>'
            '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
            for k in range(count)
        )
        yield f"{count}_joints", body.replace("</robot>", links + ends + "</robot>").encode()
        yield (
            f"{count}_fixed_joints",
            body.replace("</robot>", links + ends.replace("revolute", "fixed") + "</robot>").encode(),
        )
    root = ElementTree.fromstring(body)
    elements = list(root.iter())
    for k, element in enumerate(elements):
        for attribute in list(element.attrib):
            for label, value in {
                **ODD_TEXTS,
                **NUMBERS,
                "empty": "",
                "three": "0 0 0",
                "four": "1 2 3 4",
                "nan_word": "nan",
            }.items():
                if not _allowed(value):
                    continue
                copy = deepcopy(root)
                list(copy.iter())[k].set(attribute, value)
                yield f"{k}_{element.tag}_{attribute}_{label}", ElementTree.tostring(copy)
            copy = deepcopy(root)
            del list(copy.iter())[k].attrib[attribute]
            yield f"{k}_{element.tag}_without_{attribute}", ElementTree.tostring(copy)
    for parent in range(len(elements)):
        for child in range(len(elements[parent])):
            copy = deepcopy(root)
            above = list(copy.iter())[parent]
            tag = above[child].tag
            above.append(deepcopy(above[child]))
            yield f"{parent}_{tag}_{child}_twice", ElementTree.tostring(copy)
            del above[-1], above[child]
            yield f"{parent}_{tag}_{child}_gone", ElementTree.tostring(copy)


def by_json(content: bytes) -> Broken:
    """Every value of a JSON document replaced and removed; of a list, its first item."""
    data = json.loads(content)
    for path in _paths(data, lists=1):
        name = "_".join(map(str, path))
        for label, value in _odd_values().items():
            yield f"{name}_{label}", json.dumps(_with(data, path, value)).encode()
        yield f"{name}_gone", json.dumps(_with(data, path, _GONE)).encode()
    yield "deep", b"[" * 100_000 + b"]" * 100_000
    yield "digits", b'{"kind": ' + b"9" * 5000 + b"}"
    yield "not_a_number", content.replace(b"null", b"NaN").replace(b"0.", b"Infinity, 0.")
    yield "list", b"[]"
    yield "nothing", b"{}"
    yield "text", b'"text"'


def by_arrays(content: bytes) -> Broken:
    """The arrays of an npz file: missing, of other shapes and kinds, and not finite."""
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    for name, array in arrays.items():
        odd: dict[str, np.ndarray] = {
            "scalar": np.array(1.0),
            "empty": np.zeros(0),
            "flat": array.ravel(),
            "deeper": array[None],
            "texts": np.full(array.shape, "text"),
            "odd_texts": np.full(array.shape, ESCAPE + SCRIPT + MARKUP),
            "whole": np.zeros(array.shape, np.int64),
            "complex": np.full(array.shape, 1j),
            "boolean": np.zeros(array.shape, bool),
            "objects": np.full(array.shape, None, dtype=object),
            "dates": np.zeros(array.shape, "datetime64[s]"),
            "zeros": np.zeros(array.shape, array.dtype if array.dtype.kind != "U" else "U1"),
        }
        if array.ndim:
            odd["shorter"] = array[: len(array) // 2]
            odd["longer"] = np.concatenate([array, array])
        if array.dtype.kind == "f":
            odd |= {
                label: np.full(array.shape, value)
                for label, value in (("nan", np.nan), ("infinite", np.inf), ("huge", 1e308))
            }
            odd["minus"] = -np.abs(array) - 1.0
        for label, changed in odd.items():
            yield f"{name}_{label}", _archive(arrays | {name: changed})
        yield f"{name}_gone", _archive({other: value for other, value in arrays.items() if other != name})
    name = next(iter(arrays))
    header = b"\x93NUMPY\x01\x00"
    for label, shape in (("terabytes", "(1000000, 1000000)"), ("minus", "(-1,)"), ("words", "('a',)")):
        described = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
        yield (
            f"header_{label}",
            _zipped({f"{name}.npy": header + len(described).to_bytes(2, "little") + described.encode()}),
        )
    yield "header_cut", _zipped({f"{name}.npy": header})
    yield "header_words", _zipped({f"{name}.npy": header + b"\x08\x00{'a': 1}"})
    yield "no_arrays", _zipped({"note.txt": b"nothing"})
    yield "array_without_archive", header + b"\x10\x00" + b"{'descr': '<f8'}"
    yield "zip_bomb", _zipped({f"{name}.npy": bytes(50_000_000)})


_GONE = object()


def _odd_values() -> dict[str, Any]:
    values: dict[str, Any] = {
        "null": None,
        "text": "text",
        "list": [],
        "mapping": {},
        "nested": [[1.0], {"a": None}],
        "true": True,
    }
    return values | {"minus": -1, "huge": 1e308, "int64": 2**63, "odd": SCRIPT + ESCAPE + MARKUP}


def _paths(data: Any, lists: int = 1, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where the values stand, outer ones first; of every list `lists` items, of large mappings three entries."""
    if path:
        yield path
    if isinstance(data, dict):
        keys = list(data)
        numerous = len(keys) > 30
        for key in keys[:3] if numerous else keys:
            yield from _paths(data[key], lists, (*path, key))
    elif isinstance(data, list):
        for index in range(min(lists, len(data))):
            yield from _paths(data[index], lists, (*path, index))


def _with(data: Any, path: tuple[Any, ...], value: Any) -> Any:
    copy = deepcopy(data)
    above = copy
    for key in path[:-1]:
        above = above[key]
    if value is _GONE:
        del above[path[-1]]
    else:
        above[path[-1]] = value
    return copy


def _replaced(data: Any, path: tuple[Any, ...]) -> Broken:
    marker = "replaced here"
    text = yaml.safe_dump(_with(data, path, marker), sort_keys=False, default_flow_style=None, width=10_000)
    values = {
        "null": "null",
        "text": "text",
        "empty": "''",
        "list": "[]",
        "mapping": "{}",
        "lists": "[[1], [2, 3]]",
        "true": "true",
    }
    values |= {"mixed": "[1, a, null]", "date": "2026-01-01", "number_text": "'1'", **NUMBERS}
    values |= {label: json.dumps(word, ensure_ascii=True) for label, word in ODD_TEXTS.items()}
    for label, value in values.items():
        yield label, text.replace(marker, value).encode()
    yield "gone", yaml.safe_dump(_with(data, path, _GONE), sort_keys=False, default_flow_style=None).encode()


def _allowed(text: str) -> bool:
    """Whether XML can hold a text."""
    return not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", text)


def _archive(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=True, **arrays)
    return stream.getvalue()


def _zipped(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()
