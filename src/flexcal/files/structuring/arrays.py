"""Checked lists of numbers: arrays, and joint numbers."""

from __future__ import annotations

from typing import Any, get_args, get_origin

import numpy as np

from flexcal.files.structuring.faults import Fault, Nested
from flexcal.files.structuring.scalars import integer, number
from flexcal.files.structuring.wording import describe


def is_array(cls: Any) -> bool:
    """Whether a type is `numpy.ndarray` or `NDArray[…]`."""
    return cls is np.ndarray or get_origin(cls) is np.ndarray


def array(value: Any, cls: Any) -> np.ndarray:
    """A rectangular nested list of numbers as an array; whole numbers where the dtype asks for them."""
    whole = False
    if get_args(cls):
        dtype = get_args(get_args(cls)[1])
        whole = bool(dtype) and isinstance(dtype[0], type) and issubclass(dtype[0], np.integer)
    if not isinstance(value, list):
        raise Fault("E-YAML-019", f"a list of numbers is expected, not {describe(value)}")
    _shape(value, integer if whole else number)
    return np.array(value, dtype=np.int64 if whole else np.float64)


def _shape(value: Any, number: Any) -> tuple[int, ...]:
    if not isinstance(value, list):
        number(value)
        return ()
    shapes = []
    for index, item in enumerate(value):
        try:
            shapes.append(_shape(item, number))
        except (Fault, Nested) as problem:
            raise Nested(index, problem) from problem
        if shapes[index] != shapes[0]:
            raise Nested(
                index, Fault("E-YAML-020", f"this row has another length than the first ({describe(item)})")
            )
    return (len(value), *(shapes[0] if shapes else ()))


def joint_indices(value: Any, _: Any) -> tuple[int, ...]:
    """Joint numbers of a file, from 1, as indices from 0."""
    if not isinstance(value, list):
        raise Fault("E-YAML-021", f"a list of joint numbers is expected, not {describe(value)}")
    for position, joint in enumerate(value):
        try:
            if integer(joint) < 1:
                raise Fault(
                    "E-YAML-022",
                    f"joints are counted from 1, as in the columns q1, q2, …, so {joint} is none",
                )
        except Fault as problem:
            raise Nested(position, problem) from problem
    return tuple(joint - 1 for joint in value)
