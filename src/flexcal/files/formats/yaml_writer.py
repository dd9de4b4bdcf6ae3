"""Writing dataclasses as YAML 1.2."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.files.structuring import Keys, dotted, file_key
from flexcal.files.transaction import write_text

if TYPE_CHECKING:
    from yaml import ScalarNode
    from yaml.cyaml import CSafeDumper

_WORDS = re.compile(r"[A-Za-z_/]([A-Za-z0-9_./()-]| (?=[A-Za-z0-9_./(-]))*")


def write_yaml(path: str | Path, value: Any) -> None:
    """Write a dataclass, mapping or list as YAML, atomically; every float comes back bit by bit.

    Fields that are None are left out. Raises `FlexcalError` for NaN, infinity and objects of no YAML form.
    """
    write_text(path, yaml_text(value))


def yaml_text(value: Any) -> str:
    """`value` as the YAML text that `write_yaml` writes."""
    import yaml

    class Dumper(yaml.CSafeDumper):
        """Writes texts of more than plain words in double quotes, and what holds nothing but scalars on one line."""

        def represent_sequence(self, tag, sequence, flow_style=None):
            node = super().represent_sequence(tag, sequence, flow_style)
            node.flow_style = all(isinstance(item, yaml.ScalarNode) for item in node.value)
            return node

        def represent_mapping(self, tag, mapping, flow_style=None):
            node = super().represent_mapping(tag, mapping, flow_style)
            node.flow_style = all(isinstance(item, yaml.ScalarNode) for _, item in node.value)
            return node

    Dumper.add_representer(str, _text)
    return yaml.dump(to_plain(value), Dumper=Dumper, width=110, sort_keys=False, allow_unicode=True)


def to_plain(value: Any) -> Any:
    """`value` as dicts, lists, texts and numbers, as it would stand in a YAML or JSON file."""
    return _plain(value, ())


def _text(dumper: CSafeDumper, text: str) -> ScalarNode:
    """A text, in double quotes unless it is plain words, read alike everywhere; bytes of file names that are not UTF-8 as \\udc and hex."""
    text = text.encode("utf-8", "backslashreplace").decode("utf-8")
    style = None if _WORDS.fullmatch(text) else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style)


def _plain(value: Any, keys: Keys) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field for field in dataclasses.fields(value) if getattr(value, field.name) is not None]
        return {file_key(field): _field(value, field, keys) for field in fields}
    if isinstance(value, Mapping):
        return {str(key): _plain(item, (*keys, str(key))) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist(), keys)
    if isinstance(value, (list, tuple)):
        return [_plain(item, (*keys, i)) for i, item in enumerate(value)]
    if isinstance(value, np.generic):
        return _plain(value.item(), keys)
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, float) and not math.isfinite(value):
        raise FlexcalError(
            "E-YAML-017",
            f"{dotted(keys) or 'the value'} is {value}, which is not written; give a finite number.",
        )
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise FlexcalError(
        "E-YAML-018", f"{dotted(keys) or 'the value'} is a {type(value).__name__}, which has no form in YAML."
    )


def _field(value: Any, field: dataclasses.Field[Any], keys: Keys) -> Any:
    item = getattr(value, field.name)
    if field.metadata.get("joints"):
        return [int(index) + 1 for index in item]
    return _plain(item, (*keys, file_key(field)))
