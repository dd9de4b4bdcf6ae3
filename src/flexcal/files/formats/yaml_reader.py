"""A strict reader of YAML 1.2 into frozen dataclasses, whose errors name the file and the line.

Numbers are the numbers of YAML 1.2 (`143.7e3`, `143.7e+3` and `1e3` alike), keys are texts and stand once;
what fits a dataclass and what does not is in `flexcal.files.structuring`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from flexcal.errors import InputError, unreadable
from flexcal.files.formats.yaml_document import LARGEST_YAML, parse_document
from flexcal.files.formats.yaml_writer import write_yaml
from flexcal.files.structuring import UNQUOTED, Keys, StructureError, dotted, structure
from flexcal.files.transaction import read_text

__all__ = ["YamlFile", "read_yaml", "read_yaml_file", "write_yaml"]

T = TypeVar("T")


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

    def error(self, code: str, keys: Sequence[str | int], sentence: str) -> InputError:
        """An `InputError` that places `sentence` at the file and line of `keys`."""
        return InputError(code, f"{self.path} line {self.line(*keys)}: {sentence}")

    def structure(self, cls: type[T]) -> T:
        """The document as a `cls`; raises `InputError` with file and line where it does not fit."""
        try:
            return structure(self.data if isinstance(self.data, dict | list | None) else UNQUOTED, cls)
        except StructureError as problem:
            failure = min(problem.failures, key=lambda failure: self.line(*failure.keys))
            # a sentence on a mapping that begins with one of its keys is placed there
            said = failure.sentence.removeprefix(f"{dotted(failure.keys)}: ").split()[0].rstrip(":")
            raise self.error(failure.code, (*failure.keys, said), failure.sentence) from problem


def read_yaml(path: str | Path, cls: type[T]) -> T:
    """Read a YAML file into a class, usually a frozen dataclass.

    Parameters
    ----------
    path : str or Path
        The file.
    cls : type
        Class whose annotations say what the keys and their types are.

    Returns
    -------
    object
        An instance of `cls`.

    Raises
    ------
    InputError
        One sentence that names the file and the line, for a file that cannot be read, text that is not YAML, a key that is
        unknown, missing or given twice, and a value of the wrong type. A `FlexcalError` or `ValueError` of a dataclass's
        `__post_init__` is placed at the line of its mapping.

    Examples
    --------
    >>> from flexcal import CellConfig, read_yaml
    >>> read_yaml("examples/tx90l/cell.yaml", CellConfig).sensors.torque_noise
    1.0
    """
    return read_yaml_file(path).structure(cls)


def read_yaml_file(path: str | Path) -> YamlFile:
    """Read a YAML file as plain data, keeping the lines; raises `InputError` as `read_yaml` does."""
    path = Path(path)
    try:
        text = read_text(path, encoding="utf-8-sig", limit=LARGEST_YAML)
    except OSError as problem:
        raise unreadable(path, problem) from problem
    except UnicodeDecodeError as problem:
        raise InputError(
            "E-YAML-016", f"{path} is not UTF-8 text (byte {problem.start}); save it as UTF-8."
        ) from problem
    return YamlFile(path, *parse_document(path, text))
