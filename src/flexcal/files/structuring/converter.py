"""The converter of cattrs, strict where cattrs is lenient."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, get_args, get_origin

from flexcal.files.structuring.arrays import array, is_array, joint_indices
from flexcal.files.structuring.faults import Fault, Nested, StructureError, failures
from flexcal.files.structuring.keys import file_key
from flexcal.files.structuring.scalars import boolean, integer, literal, number, text
from flexcal.files.structuring.unions import union_hook
from flexcal.files.structuring.wording import describe

if TYPE_CHECKING:
    from cattrs import Converter

T = TypeVar("T")


def structure(data: Any, cls: type[T]) -> T:
    """`data` as a `cls`; raises `StructureError` with all that does not fit.

    A `FlexcalError` or `ValueError` of a dataclass's `__post_init__` counts as a misfit of its mapping.
    """
    try:
        return _converter().structure(data, cls)
    except Exception as problem:
        faults = failures(problem, ())
        if any(failure is None for failure in faults):
            raise
        raise StructureError([failure for failure in faults if failure is not None]) from problem


@functools.cache
def _converter() -> Converter:
    from cattrs import Converter
    from cattrs.cols import homogenous_tuple_structure_factory, list_structure_factory

    converter = Converter(forbid_extra_keys=True, detailed_validation=True)
    converter.register_structure_hook(float, lambda value, _: number(value))
    converter.register_structure_hook(int, lambda value, _: integer(value))
    converter.register_structure_hook(str, lambda value, _: text(value))
    converter.register_structure_hook(bool, lambda value, _: boolean(value))
    converter.register_structure_hook(Path, lambda value, _: Path(text(value)))
    converter.register_structure_hook_func(lambda cls: get_origin(cls) is Literal, literal)
    converter.register_structure_hook_func(is_array, array)
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
        lambda cls: get_origin(cls) in (Union, UnionType), lambda cls, inner: union_hook(cls, inner)
    )
    return converter


def _guarded(kind: type, hook: Any) -> Any:
    """`hook`, for values of this kind only: cattrs would otherwise take a text for a list of letters."""

    def structure(value: Any, cls: Any) -> Any:
        if not isinstance(value, kind):
            expected = "a list" if kind is list else "a mapping (key: value)"
            how = " (write [ ] around its entries, or a line with - before each)" if kind is list else ""
            raise Fault("E-YAML-023", f"{expected} is expected{how}, not {describe(value)}")
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
        return override(rename=file_key(field), struct_hook=joint_indices)
    return override(rename=file_key(field))


def _is_fixed_tuple(cls: Any) -> bool:
    return get_origin(cls) is tuple and Ellipsis not in get_args(cls)


def _fixed_tuple_hook(cls: Any, converter: Converter) -> Any:
    members = get_args(cls)

    def structure(value: list[Any], _: Any) -> tuple[Any, ...]:
        if len(value) != len(members):
            raise Fault("E-YAML-024", f"{len(members)} items are expected, not {len(value)}")
        return tuple(
            _at(i, converter, item, member)
            for i, (item, member) in enumerate(zip(value, members, strict=True))
        )

    return structure


def _mapping_hook(cls: Any, converter: Converter) -> Any:
    member = get_args(cls)[1]
    return lambda value, _: {key: _at(key, converter, item, member) for key, item in value.items()}


def _at(key: str | int, converter: Converter, value: Any, cls: Any) -> Any:
    try:
        return converter.structure(value, cls)
    except Exception as problem:
        raise Nested(key, problem) from problem
