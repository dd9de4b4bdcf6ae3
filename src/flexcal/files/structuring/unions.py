"""Choice among the members of a union by the form of a value."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from flexcal.files.structuring.faults import Fault
from flexcal.files.structuring.keys import known_keys
from flexcal.files.structuring.wording import describe, suggestion

if TYPE_CHECKING:
    from cattrs import Converter


def union_hook(cls: Any, converter: Converter) -> Any:
    """Conversion to the first member of a union that a value fits; its fault is that of the nearest one."""
    members = get_args(cls)

    def structure(value: Any, _: Any) -> Any:
        if value is None and NoneType in members:
            return None
        fitting = sorted(
            (member for member in members if _takes(member, value)), key=lambda m: _known(m, value)
        )
        if not fitting:
            expected = " or ".join(_expected(member) for member in members if member is not NoneType)
            raise Fault("E-YAML-033", f"{expected} is expected, not {describe(value)}")
        fitting = _of_kind(fitting, value)
        for member in fitting[:-1]:
            try:
                return converter.structure(value, member)
            except Exception:
                continue
        return converter.structure(value, fitting[-1])

    return structure


def _of_kind(members: list[Any], value: Any) -> list[Any]:
    """Those of some mappings whose `kind` is that of a value, all where the kind does not tell.

    Raises `Fault` with all kinds for one that none of them has.
    """
    kinds = {
        i: get_args(get_type_hints(m).get("kind"))
        for i, m in enumerate(members)
        if dataclasses.is_dataclass(m)
    }
    if (
        not isinstance(value, dict)
        or "kind" not in value
        or len(members) < 2
        or not all(map(kinds.get, range(len(members))))
    ):
        return members
    own = [member for i, member in enumerate(members) if value["kind"] in kinds[i]]
    if not own:
        every = sorted(str(kind) for choices in kinds.values() for kind in choices)
        near = suggestion(value["kind"], every) if isinstance(value["kind"], str) else ""
        raise Fault(
            "E-YAML-034",
            f"the kind is {describe(value['kind'])}, but must be one of {', '.join(every)}{near}",
        )
    return own


def _known(cls: Any, value: Any) -> int:
    """Number of a value's keys that a dataclass has: the fault of the nearer one of two is reported."""
    return len(value.keys() & set(known_keys(cls))) if dataclasses.is_dataclass(cls) else 0


def _kind(cls: Any) -> type:
    """Kind of a value of this type in YAML: dict, list or scalar (object)."""
    origin = get_origin(cls) or cls
    if dataclasses.is_dataclass(cls) or origin in (dict, Mapping):
        return dict
    if origin in (list, tuple, Sequence, np.ndarray):
        return list
    return object


def _takes(cls: Any, value: Any) -> bool:
    kind = _kind(cls)
    if kind is not object:
        return isinstance(value, kind)
    if isinstance(value, (dict, list)) or value is None:
        return False
    if get_origin(cls) is Literal:
        return value in get_args(cls)
    if cls is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return cls is Any or (cls is Path and isinstance(value, str)) or type(value) is cls


def _expected(cls: Any) -> str:
    kind = _kind(cls)
    if kind is not object:
        return "a mapping (key: value)" if kind is dict else "a list"
    if get_origin(cls) is Literal:
        return " or ".join(f"'{choice}'" for choice in get_args(cls))
    return {float: "a number", int: "a whole number", bool: "true or false"}.get(cls, "a text")
