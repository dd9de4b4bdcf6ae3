"""Changes of single values in a YAML text that leave every other character as it is."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError
from flexcal.files.formats.yaml_document import parse_document
from flexcal.files.formats.yaml_places import Node, yaml_nodes
from flexcal.files.structuring import Keys, dotted

_PLAIN = re.compile(r"[^\W\d][\w./ -]*[\w./-]|[^\W\d]")
"""Texts that need no quotes, unless they read as something else."""

_MARK = "\ufeff"
"""Mark that some programs put before UTF-8 text."""


class Removed:
    """Stands in place of a value that is to go, with its key."""


REMOVED = Removed()


def edited_yaml(text: str, keys: Keys, value: Any) -> str:
    """Text in which `keys` lead to `value`, plain data, or to nothing for `REMOVED`.

    A mapping takes the place of a mapping key by key, and a list that of one of the same length in lines or with comments item by item.
    Keys that are not there yet are added behind the last one. Raises `FlexcalError` where the text is no such YAML, `keys` lead through a
    list that is too short or through a scalar, or the value cannot be changed alone, as one that aliases repeat.
    """
    if text.startswith(_MARK):
        return _MARK + edited_yaml(text[1:], keys, value)
    path = Path("the text")
    before, _ = parse_document(path, text)
    expected = _with(before, keys, value)
    changed = _removed(text, keys) if isinstance(value, Removed) else _put(text, keys, value)
    try:
        after = parse_document(path, changed)[0]
    except FlexcalError:
        after = None
    if not _same(after, expected):
        raise FlexcalError(
            "E-YAML-035",
            f"{dotted(keys)} cannot be changed without changing more, as where anchors and aliases (&, *) repeat it; change it by hand.",
        )
    return changed


def _put(text: str, keys: Keys, value: Any) -> str:
    """Text with a value at `keys`, and what is missing on the way."""
    root = yaml_nodes(text)
    node, parent = root.at(keys), root.at(keys[:-1])
    if node is None and parent is not None and parent.kind == "mapping":
        return _added(text, parent, str(keys[-1]), value)
    if node is None:
        return _put(text, keys[:-1], {keys[-1]: value})
    if node.kind == "mapping" and isinstance(value, Mapping) and node.entries.keys() & value.keys():
        for key in node.entries.keys() - value.keys():
            text = _removed(text, (*keys, key))
        for key, inner in value.items():
            text = _put(text, (*keys, key), inner)
        return text
    own = text[node.start.index : node.end]
    if (
        node.kind == "list"
        and _is_list(value)
        and len(value) == len(node.items) > 0
        and (not node.flow or "#" in own)
    ):
        for k, inner in enumerate(value):
            text = _put(text, (*keys, k), inner)
        return text
    return _replaced(text, node, value)


def _removed(text: str, keys: Keys) -> str:
    """Text without a key and its value: without its lines, or its place between brackets."""
    root = yaml_nodes(text)
    parent = root.at(keys[:-1]) if keys else None
    if parent is None or parent.kind != "mapping" or keys[-1] not in parent.entries:
        raise FlexcalError("E-YAML-036", f"there is no key {dotted(keys)} to remove.")
    number = [key for key, _ in parent.keys].index(str(keys[-1]))
    first = number == 0
    if len(parent.items) == 1:
        return _replaced(text, parent, {})
    if parent.flow and first:
        return text[: parent.keys[0][1].index] + text[parent.keys[1][1].index :]
    if parent.flow:
        return text[: parent.items[number - 1].end] + text[parent.items[number].end :]
    start = text.rfind("\n", 0, parent.keys[number][1].index) + 1
    return text[:start] + text[_line_end(text, parent.items[number].end) :]


def _replaced(text: str, node: Node, value: Any) -> str:
    start, end, told = node.start.index, node.end, _told(value)
    if not node.flow:  # the lines of a block collection go, and the value stands behind its key
        start = len(text[:start].rstrip())
    if start == end or not node.flow:
        told = told if text[:start].endswith(" ") else f" {told}"
    if node.block_text:
        told += _newline(text)
    return text[:start] + told + text[end:]


def _added(text: str, parent: Node, key: str, value: Any) -> str:
    entry = f"{_told(key)}: {_told(value)}"
    if parent.flow:
        at = parent.items[-1].end if parent.items else parent.start.index + 1
        entry = f", {entry}" if parent.items else entry
    else:
        at, newline = _line_end(text, parent.items[-1].end), _newline(text)
        entry = " " * (parent.keys[0][1].column - 1) + entry
        entry = entry + newline if text[at - 1] == "\n" else newline + entry
    return text[:at] + entry + text[at:]


def _newline(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"


def _line_end(text: str, index: int) -> int:
    """Index behind the end of the line that holds the character before `index`."""
    if text[index - 1] == "\n":
        return index
    end = text.find("\n", index)
    return len(text) if end < 0 else end + 1


def _with(data: Any, keys: Keys, value: Any, depth: int = 0) -> Any:
    """Plain data, inside `depth` keys, with another value at `keys`."""
    if depth == len(keys):
        return _plain(value)
    key, last = keys[depth], depth == len(keys) - 1
    if isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
        return [_with(item, keys, value, depth + 1) if k == key else item for k, item in enumerate(data)]
    if (data is None or isinstance(data, dict)) and isinstance(key, str):
        data = data or {}
        if last and isinstance(value, Removed):
            return {name: item for name, item in data.items() if name != key}
        return data | {key: _with(data.get(key), keys, value, depth + 1)}
    raise FlexcalError("E-YAML-037", f"{dotted(keys)} leads nowhere; there is no mapping with such a key.")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if _is_list(value):
        return [_plain(item) for item in value]
    return value


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _same(one: Any, other: Any) -> bool:
    """Whether plain data are equal; 1 and 1.0 are, true and 1 are not."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return one == other and isinstance(one, bool) == isinstance(other, bool)


def _told(value: Any) -> str:
    """Plain data as YAML on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_told(str(key))}: {_told(item)}" for key, item in value.items()) + "}"
    if _is_list(value):
        return "[" + ", ".join(map(_told, value)) + "]"
    if value is None or isinstance(value, (bool, int)):
        return json.dumps(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise FlexcalError("E-YAML-038", f"a value must be a finite number, not {value}.")
        return repr(value)
    told = str(value)
    if _PLAIN.fullmatch(told) and "  " not in told and parse_document(Path("a text"), told)[0] == told:
        return told
    return json.dumps(told, ensure_ascii=False)
