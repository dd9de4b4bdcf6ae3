"""Ways to break a file, by its format: each yields (name, function that returns the broken content), the same in every run."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from functools import partial
from typing import Any
from xml.etree import ElementTree

import numpy as np
import yaml

Ways = Iterator[tuple[str, Callable[[], bytes]]]
Mutation = Callable[[bytes], Ways]

SCRIPT = "<script>alert(1)</script>"
ESCAPE = "\x1b[31mred\x1b]0;title\x07"
MARKUP = "[/red] [bold]b"
ODD_TEXTS = {
    "script": SCRIPT,
    "escape": ESCAPE,
    "markup": MARKUP,
    "format": "{0}{x}%s%(x)s",
    "surrogate": "\u202e\ufeff☃",
    "lines": "a\u2028b\x85c",
    "formula": "=1+1",
}
NUMBERS = {
    "zero": "0",
    "minus": "-1",
    "huge": "1e308",
    "minus_huge": "-1e308",
    "large": "1e50",
    "infinite": "1e999",
    "tiny": "1e-308",
    "small": "1e-12",
    "nan": ".nan",
    "int64": str(2**63),
    "million": "1000000",
    "digits": "9" * 5000,
    "octal": "0o9",
    "hexadecimal": "0xZZ",
    "long_hexadecimal": "0x" + "f" * 5000,
}
_CELLS = {
    "missing": "",
    "word": "abc",
    "nan_word": "nan",
    "infinity": "Infinity",
    "underscore": "1_000",
    "comma": '"1,5"',
    "quote": '"',
    "quoted_line": '"1\n2"',
    "spaces": "  1 ",
    "arabic": "١٢",
    "boolean": "true",
    "date": "2026-01-01",
    "nul": "\0",
    "int64_edge": str(2**63 - 1),
    "half": "0.5",
    "float53": "9007199254740993",
    "minus_int64": str(-(2**63) - 1),
    "float_int": "1e18",
    "sign": "+-1",
    "megabyte": "1" * 1_000_000,
    "megabyte_text": "x" * 1_000_000,
}
_TOKENS = (
    *(
        b"\x00",
        b"\xff\xfe",
        b"\n",
        b"\r",
        b"- ",
        b": ",
        b"{",
        b"[",
        b"<",
        b">",
        b'"',
        b"'",
        b",",
        b"*a",
        b"&a ",
    ),
    *(
        b"$(",
        b"${",
        b"%s",
        b"1e308",
        b"-1",
        b"nan",
        b"\x1b[2J",
        b"\xe2\x80\xa8",
        b"\xc2\x9b",
        b"\xed\xa0\x80",
        b"../",
    ),
)
_GONE = object()


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Parts of a content cut out, repeated, moved or replaced at random, whatever its format."""
    for _ in range(chance.choice((1, 1, 1, 2, 4, 16))):
        at, other = chance.randrange(len(content) + 1), chance.randrange(len(content) + 1)
        length = chance.choice((0, 1, 1, 2, 4, 8, 40, 1000))
        new = chance.choice(
            (chance.choice(_TOKENS), chance.randbytes(length), content[other : other + length])
        )
        content = content[:at] + new + content[at + chance.choice((0, 0, len(new), length)) :]
    return content


def by_bytes(content: bytes) -> Ways:
    """Whatever the format: cuts, foreign bytes, other encodings and ends of lines."""
    middle = len(content) // 2
    first, second = content[:middle], content[middle:]
    for label, broken in {
        "empty": b"",
        "blank": b" \n\n",
        "one_byte": content[:1],
        "half": first,
        "all_but_one": content[:-1],
        "zeros": bytes(1000),
        "nul_inside": first + b"\0" + second,
        "latin_1": first + "Käse".encode("latin-1") + second,
        "a_program": b"\x7fELF\x02\x01\x01" + bytes(range(256)) * 8,
        "a_zip": b"PK\x03\x04" + bytes(range(256)) * 4,
        "json": b'{"a": [1, 2, {"b": null}]}',
        "brackets": b"[" * 200_000,
    }.items():
        yield label, partial(bytes, broken)
    yield "twice", lambda: content + content
    yield "utf_16", lambda: b"\xff\xfe" + content.decode("latin-1").encode("utf-16-le")
    yield "utf_8_with_mark", lambda: b"\xef\xbb\xbf" + content
    for label, end in (("cr_only", b"\r"), ("crlf", b"\r\n"), ("form_feeds", b"\x0c\n"), ("one_line", b" ")):
        yield label, partial(content.replace, b"\n", end)
    for seed in range(6):
        yield f"bytes_{seed}", partial(_other_bytes, content, seed)
        yield f"moved_{seed}", partial(_moved, content, seed)


def _other_bytes(content: bytes, seed: int) -> bytes:
    changed, chance = bytearray(content), random.Random(seed)
    for _ in range(1 + len(changed) // 100):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def _moved(content: bytes, seed: int) -> bytes:
    chance = random.Random(seed)
    first, second = sorted(chance.randrange(len(content)) for _ in range(2))
    return content[second:] + content[first:second] + content[:first]


def by_yaml_text(content: bytes) -> Ways:
    """YAML as text: depth, aliases, numbers, tags."""
    text = content.decode()
    added: dict[str, Callable[[], str]] = {}
    for depth in (500, 100_000):
        added |= {
            f"lists_{depth}_deep": partial(_nested, "deep: ", "[", "]", depth),
            f"mappings_{depth}_deep": partial(_nested, "deep: ", "{a: ", "}", depth, "1"),
            f"open_lists_{depth}_deep": partial(_nested, "deep: ", "[", "", depth),
            f"dashes_{depth}_deep": partial(_nested, "deep:\n", "- ", "", depth, "1"),
        }
    added |= {
        "key_megabyte": lambda: f"{'k' * 1_000_000}: 1\n",
        "keys_many": lambda: "".join(f"k{i}: {i}\n" for i in range(20_000)),
        "value_megabyte": lambda: f"k: {'v' * 1_000_000}\n",
    }
    for label, make in added.items():
        yield label, lambda make=make: (text + make()).encode()
    levels = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 10)}]\n" for k in range(12))
    nested = "".join(f"a{k + 1}: &a{k + 1} {{x: *a{k}, y: *a{k}}}\n" for k in range(60))
    for label, broken in {
        "alias_bomb": "a0: &a0 [1]\n" + levels + text,
        "alias_mappings": "a0: &a0 {x: 1}\n" + nested + text,
        "alias_to_itself": text + "self: &self [*self]\n",
        "unknown_alias": text + "self: *nobody\n",
        "merge_key": "base: &base {x: 1}\n" + text + "merged: {<<: *base}\n",
        "tag_python": text + "run: !!python/object/apply:os.system ['true']\n",
        "tag_own": text + "run: !ours {a: 1}\n",
        "tag_int": text + "n: !!int abc\n",
        "tag_binary": text + "n: !!binary AAAA\n",
        "two_documents": text + "---\n" + text,
        "directive": "%YAML 3.7\n---\n" + text,
        "tabs": text.replace("  ", "\t"),
        "key_list": text + "? [a, b]\n: 1\n",
        "key_null": text + "~: 1\n",
        "key_script": text + f'"{SCRIPT}": 1\n',
        "key_escape": text + '"\\e[31mred\\a": 1\n',
        "key_markup": text + f'"{MARKUP}": 1\n',
        "a_list": "- 1\n- 2\n",
        "a_number": "17\n",
        "a_text": "text\n",
        "null": "null\n",
    }.items():
        yield label, broken.encode


def _nested(before: str, opening: str, closing: str, depth: int, inner: str = "") -> str:
    return f"{before}{opening * depth}{inner}{closing * depth}\n"


def by_yaml_structure(content: bytes) -> Ways:
    """Every value of a YAML file replaced and removed."""
    data = yaml.safe_load(content)
    values = {
        "null": "null",
        "text": "text",
        "empty": "''",
        "list": "[]",
        "mapping": "{}",
        "lists": "[[1], [2, 3]]",
        "true": "true",
        "mixed": "[1, a, null]",
        "date": "2026-01-01",
        "number_text": "'1'",
        **NUMBERS,
        **{label: json.dumps(word, ensure_ascii=True) for label, word in ODD_TEXTS.items()},
        "path": "../../etc/passwd",
        "device": "/dev/zero",
        "folder": ".",
    }
    for path in _paths(data):
        name = "_".join(map(str, path))
        for label, value in values.items():
            yield f"{name}_{label}", partial(_yaml_with, data, path, value)
        yield f"{name}_gone", partial(_yaml_with, data, path, None)


def _yaml_with(data: Any, path: tuple[Any, ...], value: str | None) -> bytes:
    """YAML with the text `value` at a path, or without that where it is None."""
    marker = "replaced here"
    changed = _with(data, path, _GONE if value is None else marker)
    text = yaml.safe_dump(changed, sort_keys=False, default_flow_style=None, width=10_000)
    return text.replace(marker, value or "").encode()


def by_numbers(content: bytes) -> Ways:
    """Every number of a text replaced by one that cannot be."""
    text = content.decode("latin-1")
    places = list(re.finditer(r"(?<![\w.])-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])", text))
    for k, place in enumerate(places[:: max(1, len(places) // 12)]):
        for label, number in NUMBERS.items():
            changed = text[: place.start()] + number + text[place.end() :]
            yield f"number_{k}_{label}", partial(changed.encode, "latin-1")


def by_words(content: bytes) -> Ways:
    """Every word and sign of a text removed, repeated, and replaced by another one of it or by an odd text."""
    text = content.decode("latin-1")
    places = list(re.finditer(r"\w+|[^\w\s]", text))
    for k, place in enumerate(places[:: max(1, len(places) // 60)]):
        others = {"gone": "", "twice": 2 * place[0], "other": places[(7 * k + 3) % len(places)][0]}
        others |= {"deep": "(" * 5000, "many": 1000 * (place[0] + " "), **ODD_TEXTS}
        for label, other in others.items():
            changed = text[: place.start()] + other + text[place.end() :]
            yield f"word_{k}_{label}", partial(changed.encode, "utf-8")


def by_cells(content: bytes, separator: str = ",") -> Ways:
    """Cells, columns and rows of a table with a header."""
    rows = [line.split(separator) for line in content.decode("cp1252").splitlines()]
    head = next(k for k, row in enumerate(rows) if len(row) > 1 and row[1])
    width = len(rows[head])

    def joined(table: list[list[str]]) -> bytes:
        return ("\n".join(separator.join(row) for row in table) + "\n").encode()

    def cell(line: int, column: int, text: str) -> bytes:
        return joined([[*r[:column], text, *r[column + 1 :]] if k == line else r for k, r in enumerate(rows)])

    def whole_column(column: int, text: str) -> bytes:
        return joined(
            [
                [*row[:column], text, *row[column + 1 :]] if k > head and len(row) > column else row
                for k, row in enumerate(rows)
            ]
        )

    texts = ODD_TEXTS | NUMBERS | _CELLS
    headers = {**ODD_TEXTS, "empty": "", "same": rows[head][0], "megabyte": "h" * 1_000_000, "quote": '"'}
    for column in range(width):
        for label, text in texts.items():
            yield f"line_{head + 1}_column_{column}_{label}", partial(cell, head + 1, column, text)
            if label in ("missing", "word", "huge"):
                yield (
                    f"line_{len(rows) - 1}_column_{column}_{label}",
                    partial(cell, len(rows) - 1, column, text),
                )
            if label in ("zero", "huge", "minus_huge", "int64", "tiny", "word", "missing", "escape"):
                yield f"column_{column}_all_{label}", partial(whole_column, column, text)
        for label, text in headers.items():
            yield f"header_{column}_{label}", partial(cell, head, column, text)
        yield f"without_{column}", lambda c=column: joined([row[:c] + row[c + 1 :] for row in rows])
        yield f"twice_{column}", lambda c=column: joined([[*row, *row[c : c + 1]] for row in rows])
    for label, table in {
        "no_rows": rows[: head + 1],
        "one_row": rows[: head + 2],
        "two_rows": rows[: head + 3],
        "no_header": rows[head + 1 :],
        "reversed": [*rows[: head + 1], *rows[:head:-1]],
        "same_rows": [*rows[: head + 1], *[rows[head + 1]] * 20],
        "five_times": [*rows[: head + 1], *rows[head + 1 :] * 5],
        "ragged": [row[: 1 + k % width] if k > head else row for k, row in enumerate(rows)],
        "blank_line": [*rows[: head + 2], [""], *rows[head + 2 :]],
        "comment_line": [*rows[: head + 2], ["# note"], *rows[head + 2 :]],
        "transposed": [[row[k] if k < len(row) else "" for row in rows[head:]] for k in range(width)],
    }.items():
        yield label, partial(joined, table)
    yield (
        "columns_1000",
        lambda: joined(
            [[*row, *[f"c{i}" if k == head else "1" for i in range(1000)]] for k, row in enumerate(rows)]
        ),
    )
    yield "semicolons", partial(content.replace, b",", b";")
    yield "tabs", partial(content.replace, separator.encode(), b"\t")


def by_xml(content: bytes) -> Ways:
    """Elements and attributes of an XML file, its encoding and entities."""
    text = content.decode()
    for encoding in ("latin-1", "utf-16", "utf-32", "x-unknown", "cp037", "", "ascii", "koi8-r", "shift_jis"):
        declared = text.replace('encoding="UTF-8"', f'encoding="{encoding}"')
        yield f"declared_{encoding or 'empty'}", declared.encode
    for encoding in ("utf-16", "utf-32", "latin-1", "cp037", "koi8-r", "shift_jis"):
        declared = text.replace('encoding="UTF-8"', f'encoding="{encoding}"').replace("axis_1", "ось_1")
        yield f"encoded_{encoding}", partial(declared.encode, encoding, "replace")
    body = text.partition("?>")[2]
    bomb = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(12))
    file = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>'
    links = {"namespace": "", "xacro_element": '<xacro:property name="a" value="1"/>'}
    for label, broken in {
        "entity_bomb": f'<!DOCTYPE robot [<!ENTITY a0 "aaaaaaaaaa">{bomb}]>{body.replace("axis_1", "&a12;")}',
        "entity_file": f"{file}{body.replace('axis_1', '&x;')}",
        "entity_name": f'<!DOCTYPE robot [<!ENTITY x "axis">]>{body.replace("axis_1", "&x;_1")}',
        "comments": body.replace("<link", "<!-- --><link"),
        "cdata": body.replace("</robot>", "<![CDATA[<a>]]></robot>"),
        "xacro": body.replace("0.45", "${length}"),
        "link_named_as_joint": body.replace("upper", "axis_2"),
        "all_one_name": re.sub("axis_[123]|mount|flange", "same", body),
        "universe": re.sub("flange", "universe", body),
        **{
            label: body.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ').replace(
                "</robot>", f"{inside}</robot>"
            )
            for label, inside in links.items()
        },
    }.items():
        yield label, broken.encode
    for depth in (500, 100_000):
        yield f"{depth}_deep", partial(_before_end, body, partial(_nested, "", "<a>", "</a>", depth))
    for count in (100, 1100, 16_000):
        for kind in ("revolute", "fixed"):
            name = f"{count}_joints" if kind == "revolute" else f"{count}_fixed_joints"
            yield name, partial(_before_end, body, partial(_chain, count, kind))
    try:
        root = ElementTree.fromstring(body)
    except ElementTree.ParseError:
        return
    odd = {**ODD_TEXTS, **NUMBERS, "empty": "", "three": "0 0 0", "four": "1 2 3 4", "nan_word": "nan"}
    odd |= {"attributes": "${().__class__}", "load": "${xacro.load_yaml('/etc/passwd')}", "find": "$(find x)"}
    odd |= {"eval": "$(eval open('/etc/passwd').read())", "lambda": "${(lambda: 1)()}", "power": "${9**9**9}"}
    odd |= {"repeated": "${'a' * 10**10}", "path": "../home/secret", "device": "/dev/zero"}
    for k, element in enumerate(root.iter()):
        tag = element.tag.rpartition("}")[2]
        for attribute in element.attrib:
            for label, value in odd.items():
                if not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", value):  # others XML cannot hold
                    yield f"{k}_{tag}_{attribute}_{label}", partial(_xml_with, root, k, attribute, value)
            yield f"{k}_{tag}_without_{attribute}", partial(_xml_with, root, k, attribute, None)
        for child, below in enumerate(element):
            name = f"{k}_{below.tag.rpartition('}')[2]}_{child}"
            yield f"{name}_twice", partial(_xml_children, root, k, lambda c, i: [*c, deepcopy(c[i])], child)
            yield f"{name}_gone", partial(_xml_children, root, k, lambda c, i: [*c[:i], *c[i + 1 :]], child)


def _before_end(body: str, more: Callable[[], str]) -> bytes:
    return body.replace("</robot>", more() + "</robot>").encode()


def _chain(count: int, kind: str) -> str:
    """Joints in a row from the flange on."""
    names = ["flange", *(f"l{k}" for k in range(count))]
    links = "".join(f'<link name="{name}"/>' for name in names[1:])
    return links + "".join(
        f'<joint name="j{k}" type="{kind}"><parent link="{names[k]}"/><child link="{names[k + 1]}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(count)
    )


def _xml_with(root: ElementTree.Element, k: int, attribute: str, value: str | None) -> bytes:
    copy = deepcopy(root)
    element = list(copy.iter())[k]
    if value is None:
        del element.attrib[attribute]
    else:
        element.set(attribute, value)
    return ElementTree.tostring(copy)


def _xml_children(root: ElementTree.Element, k: int, change: Callable[..., list[Any]], child: int) -> bytes:
    copy = deepcopy(root)
    element = list(copy.iter())[k]
    element[:] = change(list(element), child)
    return ElementTree.tostring(copy)


def by_json(content: bytes) -> Ways:
    """Every value of a JSON document replaced and removed; of a list, its first item."""
    data = json.loads(content)
    values: dict[str, Any] = {
        "null": None,
        "text": "text",
        "list": [],
        "mapping": {},
        "true": True,
        "minus": -1,
    }
    values |= {
        "nested": [[1.0], {"a": None}],
        "huge": 1e308,
        "int64": 2**63,
        "nan": float("nan"),
        "large": 1e50,
    }
    values |= {"odd": SCRIPT + ESCAPE + MARKUP, "path": "../home/secret", "lines": "a\u2028b\nc", "zero": 0}
    for path in _paths(data):
        name = "_".join(map(str, path))
        for label, value in values.items():
            yield f"{name}_{label}", lambda p=path, v=value: json.dumps(_with(data, p, v)).encode()
        yield f"{name}_gone", lambda p=path: json.dumps(_with(data, p, _GONE)).encode()
    yield "deep", lambda: b"[" * 1_000_000 + b"]" * 1_000_000
    yield "digits", lambda: b'{"kind": ' + b"9" * 5000 + b"}"
    yield "not_a_number", lambda: content.replace(b"null", b"NaN").replace(b"0.", b"Infinity, 0.")
    for label, text in (("list", b"[]"), ("nothing", b"{}"), ("text", b'"text"')):
        yield label, partial(bytes, text)


def by_arrays(content: bytes) -> Ways:
    """The arrays of an npz file: missing, of other shapes and kinds, and not finite."""
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    for name, array in arrays.items():
        for label, odd in _odd_arrays(array).items():
            yield f"{name}_{label}", lambda n=name, make=odd: _archive(arrays | {n: make()})
        others = {other: value for other, value in arrays.items() if other != name}
        yield f"{name}_gone", partial(_archive, others)
    name = next(iter(arrays))
    magic = b"\x93NUMPY\x01\x00"
    for label, shape in (("terabytes", "(1000000, 1000000)"), ("minus", "(-1,)"), ("words", "('a',)")):
        described = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
        header = magic + len(described).to_bytes(2, "little") + described.encode()
        yield f"header_{label}", partial(_zipped, {f"{name}.npy": header})
    yield "header_cut", partial(_zipped, {f"{name}.npy": magic})
    yield "header_words", partial(_zipped, {f"{name}.npy": magic + b"\x08\x00{'a': 1}"})
    yield "no_arrays", partial(_zipped, {"note.txt": b"nothing"})
    yield "array_without_archive", lambda: magic + b"\x10\x00" + b"{'descr': '<f8'}"
    yield "zip_bomb", lambda: _zipped({f"{name}.npy": bytes(50_000_000)})
    yield "array_bomb", lambda: _archive(arrays | {name: np.zeros(20_000_000)})


def _odd_arrays(array: np.ndarray) -> dict[str, Callable[[], np.ndarray]]:
    shape = array.shape
    odd: dict[str, Callable[[], np.ndarray]] = {
        "scalar": lambda: np.array(1.0),
        "empty": lambda: np.zeros(0),
        "flat": array.ravel,
        "deeper": lambda: array[None],
        "objects": lambda: np.full(shape, None, dtype=object),
        "zeros": lambda: np.zeros(shape, array.dtype if array.dtype.kind != "U" else "U1"),
    }
    for label, kind in (("whole", np.int64), ("boolean", bool), ("dates", "datetime64[s]")):
        odd[label] = partial(np.zeros, shape, kind)
    for label, value in (("texts", "text"), ("odd_texts", ESCAPE + SCRIPT + MARKUP), ("complex", 1j)):
        odd[label] = partial(np.full, shape, value)
    if array.ndim:
        odd["shorter"] = lambda: array[: len(array) // 2]
        odd["longer"] = lambda: np.concatenate([array, array])
    if array.dtype.kind == "f":
        for label, value in (("nan", np.nan), ("infinite", np.inf), ("huge", 1e308), ("large", 1e50)):
            odd[label] = partial(np.full, shape, value)
        odd["minus"] = lambda: -np.abs(array) - 1.0
    return odd


def by_members(content: bytes) -> Ways:
    """The files in a zip archive, as an Excel file is: each damaged, missing, and too large."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for name, member in members.items():
        for seed in range(40):
            yield (
                f"{name}_{seed}",
                lambda n=name, m=member, s=seed: _zipped(members | {n: damaged(m, random.Random(s))}),
            )
        yield (
            f"{name}_gone",
            partial(_zipped, {other: value for other, value in members.items() if other != name}),
        )
        yield f"{name}_bomb", lambda n=name, m=member: _zipped(members | {n: m + bytes(100_000_000)})
        yield f"{name}_outside", partial(_zipped, members | {f"../../{name}": member})


def by_rows(content: bytes) -> Ways:
    """A Parquet file with columns of other kinds, and of many rows in little space."""
    import polars as pl

    table = pl.read_parquet(io.BytesIO(content))
    for name in table.columns:
        for label, series in {
            "texts": pl.lit("text"),
            "odd_texts": pl.lit(ESCAPE + SCRIPT),
            "null": pl.lit(None),
            "nan": pl.lit(float("nan")),
            "huge": pl.lit(1e308),
            "boolean": pl.lit(True),
            "lists": pl.concat_list(pl.lit(1.0), pl.lit(2.0)),
            "structs": pl.struct(pl.lit(1).alias("a")),
            "dates": pl.lit("2026-01-01").str.to_date(),
        }.items():
            yield f"{name}_{label}", lambda n=name, s=series: _parquet(table.with_columns(s.alias(n)))
        yield f"{name}_gone", lambda n=name: _parquet(table.drop(n))
        yield f"{name}_odd", lambda n=name: _parquet(table.rename({n: ESCAPE + n}))
    yield "no_rows", lambda: _parquet(table.clear())
    yield (
        "many_rows",
        lambda: _parquet(pl.concat([table[:1]] * 1000).join(pl.DataFrame({"k": range(3000)}), how="cross")),
    )


def _parquet(table: Any) -> bytes:
    stream = io.BytesIO()
    table.write_parquet(stream)
    return stream.getvalue()


def by_image(content: bytes) -> Ways:
    """The header of a PNG: sizes that no camera has, with the checksum that they need, and chunks that are missing."""
    import struct
    import zlib

    def sized(width: int, height: int, depth: int, colour: int) -> bytes:
        body = b"IHDR" + struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
        return content[:12] + body + struct.pack(">I", zlib.crc32(body)) + content[33:]

    for label, size in {
        "zero": (0, 0),
        "one": (1, 1),
        "wide": (2**31 - 1, 1),
        "large": (60_000, 60_000),
        "larger": (2**16, 2**16),
        "other": (319, 240),
    }.items():
        for depth, colour in ((8, 0), (16, 6), (1, 3), (7, 9)):
            yield f"size_{label}_{depth}_{colour}", partial(sized, *size, depth, colour)
    yield "header_only", lambda: content[:33]
    yield "no_end", lambda: content[:-12]


def _paths(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where the values stand, outer ones first; of every list the first item, of large mappings three entries."""
    if path:
        yield path
    inner: Mapping[Any, Any] = (
        data if isinstance(data, dict) else dict(enumerate(data[:1] if isinstance(data, list) else ()))
    )
    for key in list(inner)[: 3 if len(inner) > 30 else None]:
        yield from _paths(inner[key], (*path, key))


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


def _archive(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=True, **arrays)
    return stream.getvalue()


def _zipped(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()
