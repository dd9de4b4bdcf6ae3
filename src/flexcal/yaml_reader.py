"""A strict reader of YAML 1.2 into frozen dataclasses, whose errors name the file and the line.

Numbers are the numbers of YAML 1.2 (`143.7e3`, `143.7e+3` and `1e3` alike), keys are texts and stand once;
what fits a dataclass and what does not is in `flexcal.structuring`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from flexcal.errors import InputError
from flexcal.structuring import Keys, MisfitError, structure
from flexcal.yaml_writer import write_yaml

if TYPE_CHECKING:
    from yaml import Node, ScalarNode

__all__ = ["YamlFile", "read_yaml", "read_yaml_file", "write_yaml"]

T = TypeVar("T")

_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NO_NUMBER = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NULL = {"", "~", "null", "Null", "NULL"}
_TRUTH = {
    word: value for value in (True, False) for word in (str(value), str(value).lower(), str(value).upper())
}
_TAGS = {f"tag:yaml.org,2002:{name}" for name in ["null", "bool", "int", "float", "str", "seq", "map"]}


@dataclass(frozen=True)
class YamlFile:
    """A YAML document as plain Python data, with the line of every key and item (first line is 1)."""

    path: Path
    data: Any
    lines: Mapping[Keys, int]

    def line(self, *keys: str | int) -> int:
        """Line of the value reached by these keys; of the nearest enclosing one where there is none."""
        while keys and keys not in self.lines:
            keys = keys[:-1]
        return self.lines.get(keys, 1)

    def error(self, keys: Sequence[str | int], sentence: str) -> InputError:
        """An `InputError` that places `sentence` at the file and line of `keys`."""
        return InputError(f"{self.path} line {self.line(*keys)}: {sentence}")

    def structure(self, cls: type[T]) -> T:
        """The document as a `cls`; raises `InputError` with file and line where it does not fit."""
        try:
            return structure(self.data, cls)
        except MisfitError as problem:
            keys, sentence = min(problem.failures, key=lambda failure: self.line(*failure[0]))
            raise self.error(keys, sentence) from problem


def read_yaml(path: str | Path, cls: type[T]) -> T:
    """Read a YAML file into `cls`, usually a frozen dataclass.

    Raises `InputError` with one sentence that names the file and the line, for a file that cannot be read,
    text that is not YAML, a key that is unknown, missing or given twice, and a value of the wrong type. A
    `FlexcalError` or `ValueError` of a dataclass's `__post_init__` is placed at the line of its mapping.
    """
    return read_yaml_file(path).structure(cls)


def read_yaml_file(path: str | Path) -> YamlFile:
    """Read a YAML file as plain data, keeping the lines; raises `InputError` as `read_yaml` does."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise InputError(f"{path} cannot be read ({reason}); check the name and the folder.") from problem
    except UnicodeDecodeError as problem:
        raise InputError(f"{path} is not UTF-8 text (byte {problem.start}); save it as UTF-8.") from problem
    node = _compose(path, text)
    if node is None:
        raise InputError(f"{path} line 1: the file is empty; write at least one key.")
    lines: dict[Keys, int] = {(): node.start_mark.line + 1}
    return YamlFile(path, _construct(path, node, (), lines, ()), lines)


def _compose(path: Path, text: str) -> Node | None:
    from yaml import CSafeLoader, MarkedYAMLError, YAMLError

    loader = None
    try:
        loader = CSafeLoader(text)
        # plain scalars stay texts, for `_scalar`: PyYAML would read them by YAML 1.1, where `no` is false and 1e3 a text
        loader.yaml_implicit_resolvers = {}
        return loader.get_single_node()
    except MarkedYAMLError as problem:
        mark = problem.problem_mark or problem.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
        what = " ".join(str(problem.problem or problem.context or "the text stops").split())
        raise InputError(f"{path} {place}: not valid YAML ({what}); correct it there.") from None
    except YAMLError as problem:
        what = " ".join(str(problem).split())
        raise InputError(f"{path}: not valid YAML ({what}); correct it.") from None
    finally:
        if loader is not None:
            loader.dispose()


def _construct(path: Path, node: Node, keys: Keys, lines: dict[Keys, int], above: tuple[int, ...]) -> Any:
    from yaml import MappingNode, ScalarNode, SequenceNode

    line = node.start_mark.line + 1
    if id(node) in above:
        raise InputError(f"{path} line {line}: an alias refers to itself; write the value out.")
    above = (*above, id(node))
    tag = str(node.tag)
    if tag not in _TAGS:
        raise InputError(f"{path} line {line}: the tag '{tag}' is not understood; remove it.")
    if isinstance(node, ScalarNode):
        return _scalar(node)
    if isinstance(node, SequenceNode):
        for index, item in enumerate(node.value):
            lines[(*keys, index)] = item.start_mark.line + 1
        return [_construct(path, item, (*keys, i), lines, above) for i, item in enumerate(node.value)]
    assert isinstance(node, MappingNode)
    data: dict[str, Any] = {}
    for key_node, item in node.value:
        key_line = key_node.start_mark.line + 1
        if not isinstance(key_node, ScalarNode):
            raise InputError(f"{path} line {key_line}: a key must be a plain name, not a list or a mapping.")
        key = str(key_node.value)
        if key in data:
            first = lines[(*keys, key)]
            raise InputError(
                f"{path} line {key_line}: the key '{key}' stands here and on line {first}; keep one."
            )
        lines[(*keys, key)] = key_line
        data[key] = _construct(path, item, (*keys, key), lines, above)
    return data


def _scalar(node: ScalarNode) -> Any:
    """A scalar by the core schema of YAML 1.2."""
    text = str(node.value)
    if node.style:
        return text
    if text in _NULL:
        return None
    if text in _TRUTH:
        return _TRUTH[text]
    if re.fullmatch(r"[-+]?[0-9]+", text):
        return int(text)
    if re.fullmatch(r"0[xo][0-9a-fA-F]+", text):
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _NO_NUMBER.fullmatch(text):
        return float(text.replace(".", ""))
    return text
