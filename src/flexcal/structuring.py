"""Strict conversion of plain data (dicts, lists, texts, numbers) to frozen dataclasses, by cattrs.

A Boolean or a text is never a number, NaN, infinity and numbers beyond `units.LARGEST` are refused, whole numbers have at
most 8 bytes, an unknown key is refused with the nearest known one. Arrays (`numpy.ndarray`, `NDArray[np.int64]`) are
rectangular nested lists of numbers. Of a union, the members that have the form of the value (mapping, list or scalar) are
tried in order, dataclasses that know more of its keys later.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, cast, get_args, get_origin

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.units import LARGEST

if TYPE_CHECKING:
    from cattrs import Converter

T = TypeVar("T")
Keys = tuple[str | int, ...]
_QUOTED = 40
"""Letters of a value that a message quotes."""


class MisfitError(FlexcalError):
    """Data that does not fit a class; `failures` pairs the keys leading to a fault with a sentence."""

    def __init__(self, failures: list[tuple[Keys, str]]):
        super().__init__(failures[0][1])
        self.failures = failures


def structure(data: Any, cls: type[T]) -> T:
    """`data` as a `cls`; raises `MisfitError` with all that does not fit.

    A `FlexcalError` or `ValueError` of a dataclass's `__post_init__` counts as a misfit of its mapping.
    """
    try:
        return _converter().structure(data, cls)
    except Exception as problem:
        failures = _failures(problem, ())
        if any(failure is None for failure in failures):
            raise
        raise MisfitError([failure for failure in failures if failure is not None]) from problem


def dotted(keys: Keys) -> str:
    """Keys as people write them: `elastic[0].drive`."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else str(key)
    return text


def file_key(field: dataclasses.Field[Any]) -> str:
    """The key under which a dataclass's field stands in a file: its name, or `field(metadata={"key": …})`.

    `field(metadata={"joints": True})` marks joint indices: counted from 0 in the program, from 1 in files, as the
    columns q1…qn are.
    """
    return field.metadata.get("key", field.name)


def suggestion(word: str, known: Sequence[str]) -> str:
    """`; did you mean '…'?` with the nearest known word, or nothing."""
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return f"; did you mean '{near[0]}'?" if near else ""


class _Unfit(ValueError):
    """A value that does not fit its field; the message is a sentence without place."""


@functools.cache
def _converter() -> Converter:
    from cattrs import Converter
    from cattrs.cols import homogenous_tuple_structure_factory, list_structure_factory

    converter = Converter(forbid_extra_keys=True, detailed_validation=True)
    converter.register_structure_hook(float, lambda value, _: _number(value))
    converter.register_structure_hook(int, lambda value, _: _integer(value))
    converter.register_structure_hook(str, lambda value, _: _text(value))
    converter.register_structure_hook(bool, lambda value, _: _boolean(value))
    converter.register_structure_hook(Path, lambda value, _: Path(_text(value)))
    converter.register_structure_hook_func(lambda cls: get_origin(cls) is Literal, _literal)
    converter.register_structure_hook_func(_is_array, _array)
    converter.register_structure_hook_factory(
        dataclasses.is_dataclass, lambda cls, inner: _guarded(dict, _dataclass_hook(cls, inner))
    )
    converter.register_structure_hook_factory(
        lambda cls: cls in (tuple, list) or get_origin(cls) in (tuple, list, Sequence),
        lambda cls, inner: _guarded(
            list,
            _fixed_tuple_hook(cls, inner)
            if _is_fixed_tuple(cls)
            else homogenous_tuple_structure_factory(cls, inner)
            if get_origin(cls) is tuple
            else list_structure_factory(cls, inner),
        ),
    )
    converter.register_structure_hook_factory(
        lambda cls: get_origin(cls) in (dict, Mapping),
        lambda cls, inner: _guarded(dict, _mapping_hook(cls, inner)),
    )
    converter.register_structure_hook_factory(
        lambda cls: get_origin(cls) in (Union, UnionType), lambda cls, inner: _union_hook(cls, inner)
    )
    return converter


def _guarded(kind: type, hook: Any) -> Any:
    """`hook`, for values of this kind only: cattrs would otherwise take a text for a list of letters."""

    def structure(value: Any, cls: Any) -> Any:
        if not isinstance(value, kind):
            expected = "a list" if kind is list else "a mapping (key: value)"
            raise _Unfit(f"{expected} is expected, not {_describe(value)}")
        return hook(value, cls)

    return structure


def _dataclass_hook(cls: Any, converter: Converter) -> Any:
    from cattrs.gen import make_dict_structure_fn

    renamed = {field.name: _override(field) for field in dataclasses.fields(cls)}
    return make_dict_structure_fn(
        cls, converter, _cattrs_forbid_extra_keys=True, _cattrs_detailed_validation=True, **renamed
    )


def _override(field: dataclasses.Field[Any]) -> Any:
    from cattrs.gen import override

    if field.metadata.get("joints"):
        return override(rename=file_key(field), struct_hook=_joint_indices)
    return override(rename=file_key(field))


def _is_fixed_tuple(cls: Any) -> bool:
    return get_origin(cls) is tuple and Ellipsis not in get_args(cls)


def _fixed_tuple_hook(cls: Any, converter: Converter) -> Any:
    members = get_args(cls)

    def structure(value: list[Any], _: Any) -> tuple[Any, ...]:
        if len(value) != len(members):
            raise _Unfit(f"{len(members)} items are expected, not {len(value)}")
        return tuple(
            _at(i, converter, item, member)
            for i, (item, member) in enumerate(zip(value, members, strict=True))
        )

    return structure


def _mapping_hook(cls: Any, converter: Converter) -> Any:
    member = get_args(cls)[1]
    return lambda value, _: {key: _at(key, converter, item, member) for key, item in value.items()}


class _Nested(Exception):
    """A failure inside an item of a mapping or a tuple of fixed length."""

    def __init__(self, key: str | int, cause: BaseException):
        super().__init__(str(cause))
        self.key = key
        self.cause = cause


def _at(key: str | int, converter: Converter, value: Any, cls: Any) -> Any:
    try:
        return converter.structure(value, cls)
    except Exception as problem:
        raise _Nested(key, problem) from problem


def _union_hook(cls: Any, converter: Converter) -> Any:
    members = get_args(cls)

    def structure(value: Any, _: Any) -> Any:
        if value is None and NoneType in members:
            return None
        fitting = sorted(
            (member for member in members if _takes(member, value)), key=lambda m: _known(m, value)
        )
        if not fitting:
            expected = " or ".join(_expected(member) for member in members if member is not NoneType)
            raise _Unfit(f"{expected} is expected, not {_describe(value)}")
        for member in fitting[:-1]:
            try:
                return converter.structure(value, member)
            except Exception:
                continue
        return converter.structure(value, fitting[-1])

    return structure


def _known(cls: Any, value: Any) -> int:
    """How many of a value's keys a dataclass has: of two, the fault of the nearer one is told."""
    return len(value.keys() & set(_known_keys(cls))) if dataclasses.is_dataclass(cls) else 0


def _kind(cls: Any) -> type:
    """How a value of this type stands in YAML: dict, list or scalar (object)."""
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


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _Unfit(f"a number is expected, not {_describe(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _Unfit(f"a finite number is expected, not {_describe(value)}")
    if abs(number) > LARGEST:
        raise _Unfit(f"a number below {LARGEST:.0e} is expected, not {number:g}")
    return number


def _integer(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise _Unfit(f"a whole number is expected, not {_describe(value)}")
    if not -(2**63) <= value < 2**63:
        raise _Unfit(f"a whole number of at most 8 bytes is expected, not {value:.3g}")
    return value


def _joint_indices(value: Any, _: Any) -> tuple[int, ...]:
    """Joint numbers of a file, from 1, as indices from 0."""
    if not isinstance(value, list):
        raise _Unfit(f"a list of joint numbers is expected, not {_describe(value)}")
    for position, number in enumerate(value):
        try:
            if _integer(number) < 1:
                raise _Unfit(f"joints are counted from 1, as in the columns q1, q2, …, so {number} is none")
        except _Unfit as problem:
            raise _Nested(position, problem) from problem
    return tuple(number - 1 for number in value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise _Unfit(f"a text is expected, not {_describe(value)}")
    return value


def _boolean(value: Any) -> bool:
    if not isinstance(value, bool):
        raise _Unfit(f"true or false is expected, not {_describe(value)}")
    return value


def _literal(value: Any, cls: Any) -> Any:
    choices = get_args(cls)
    for choice in choices:
        if type(choice) is type(value) and choice == value:
            return choice
    near = suggestion(value, [str(choice) for choice in choices]) if isinstance(value, str) else ""
    listed = ", ".join(f"'{choice}'" for choice in choices)
    raise _Unfit(f"{_describe(value)} is none of {listed}{near}")


def _is_array(cls: Any) -> bool:
    return cls is np.ndarray or get_origin(cls) is np.ndarray


def _array(value: Any, cls: Any) -> np.ndarray:
    """A rectangular nested list of numbers as an array; whole numbers where the dtype asks for them."""
    whole = False
    if get_args(cls):
        dtype = get_args(get_args(cls)[1])
        whole = bool(dtype) and isinstance(dtype[0], type) and issubclass(dtype[0], np.integer)
    if not isinstance(value, list):
        raise _Unfit(f"a list of numbers is expected, not {_describe(value)}")
    _shape(value, _integer if whole else _number)
    return np.array(value, dtype=np.int64 if whole else np.float64)


def _shape(value: Any, number: Any) -> tuple[int, ...]:
    if not isinstance(value, list):
        number(value)
        return ()
    shapes = []
    for index, item in enumerate(value):
        try:
            shapes.append(_shape(item, number))
        except (_Unfit, _Nested) as problem:
            raise _Nested(index, problem) from problem
        if shapes[index] != shapes[0]:
            raise _Nested(index, _Unfit(f"this row has another length than the first ({_describe(item)})"))
    return (len(value), *(shapes[0] if shapes else ()))


def _describe(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        text = " ".join(value.split())
        return f"the text '{text if len(text) <= _QUOTED else text[: _QUOTED - 1] + '…'}'"
    return f"{value:.6g}" if isinstance(value, int) and abs(value) > 10**_QUOTED else str(value)


def _failures(problem: BaseException, keys: Keys) -> list[tuple[Keys, str] | None]:
    """All failures in an exception of cattrs as (keys, sentence); None for one not the data's fault."""
    from cattrs.errors import (
        AttributeValidationNote,
        ClassValidationError,
        ForbiddenExtraKeysError,
        IterableValidationNote,
    )

    if isinstance(problem, _Nested):
        return _failures(problem.cause, (*keys, problem.key))
    if isinstance(problem, ForbiddenExtraKeysError):
        known = _known_keys(problem.cl)
        return [((*keys, key), _unknown_key(key, keys, known)) for key in problem.extra_fields]
    if isinstance(problem, BaseExceptionGroup):
        found: list[tuple[Keys, str] | None] = []
        misspelt = any(isinstance(inner, ForbiddenExtraKeysError) for inner in problem.exceptions)
        for inner in problem.exceptions:
            place = keys
            for note in getattr(inner, "__notes__", ()):
                if isinstance(note, AttributeValidationNote):
                    place = (*keys, _key_of(problem, note.name))
                elif isinstance(note, IterableValidationNote):
                    place = (*keys, cast("str | int", note.index))
            if isinstance(inner, KeyError) and isinstance(problem, ClassValidationError) and place != keys:
                name = str(place[-1])
                if misspelt:  # the unknown key, named by its own failure, is probably this one
                    continue
                found.append((keys, f"the key '{name}'{_inside(keys)} is missing; add '{name}: …'."))
            else:
                found.extend(_failures(inner, place))
        return found
    if isinstance(problem, (_Unfit, FlexcalError, ValueError, TypeError)):
        subject = f"{dotted(keys)}: " if keys else ""
        sentence = str(problem)
        return [(keys, subject + sentence + ("" if sentence.endswith((".", "?")) else "."))]
    return [None]


def _key_of(problem: BaseExceptionGroup, name: str) -> str:
    """The key in the file of the attribute `name` of the class that `problem` is about."""
    cls = getattr(problem, "cl", None)
    fields = dataclasses.fields(cls) if cls is not None and dataclasses.is_dataclass(cls) else ()
    return next((file_key(field) for field in fields if field.name == name), name)


def _known_keys(cls: Any) -> list[str]:
    return [file_key(field) for field in dataclasses.fields(cls) if field.init]


def _unknown_key(key: str, keys: Keys, known: list[str]) -> str:
    near = suggestion(key, known)
    hint = near or f"; known are {', '.join(known)}."
    return f"unknown key '{key}'{_inside(keys)}{hint}"


def _inside(keys: Keys) -> str:
    return f" in {dotted(keys)}" if keys else ""
