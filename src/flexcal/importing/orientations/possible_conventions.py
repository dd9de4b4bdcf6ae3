"""Conventions that columns of orientation may have, the usual ones first."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from flexcal.importing.orientations.conventions import (
    AngleUnit,
    Convention,
    EulerAngles,
    Quaternion,
    RotationVector,
    parse_convention,
)

_BY_AXIS = (
    "xyz-extrinsic",
    "xyz-intrinsic",
    "xzy-intrinsic",
    "yxz-intrinsic",
    "yzx-intrinsic",
    "zxy-intrinsic",
)
"""All products of three rotations about x, y and z: those about fixed axes are the same in the opposite order."""
_USUAL = ("zyx-intrinsic", "xyz-extrinsic", "zyz-intrinsic", "xyz-intrinsic", "zxz-intrinsic")
_LARGEST_RAD = 1.05 * 2 * np.pi
"""Beyond this, angles are in degrees."""


def candidates(
    values: np.ndarray, unit: AngleUnit | None, *, by_axis: bool, scalar_first: bool | None = None
) -> list[Convention]:
    """Conventions of `values` (N, 3) or (N, 4), as far as their columns' names and units leave them open.

    unit: of angles, None where it is not said. by_axis: three columns are named by the axes x, y, z, else they are in the order of turning.
    scalar_first: of quaternions whose components are known by name, None where they are not.
    """
    if values.shape[1] == 4:
        orders = (True, False) if scalar_first is None else (scalar_first,)
        return [Quaternion(transposed, first) for transposed in (False, True) for first in orders]
    units = angle_units(values) if unit is None else (unit,)
    listed: list[Convention] = []
    for transposed in ("", "-transposed"):
        names = [*(_BY_AXIS if by_axis else _all_sequences()), "rotation-vector"]
        listed += [
            parse_convention(name + transposed, 3, of, by_axis=by_axis) for of in units for name in names
        ]
    return listed


def reordered_candidates(values: np.ndarray) -> list[Convention]:
    """Conventions of `values` (N, 3) that the names of their columns exclude: in any order, about any axes, in any unit."""
    listed: list[Convention] = []
    for transposed, unit in product((False, True), angle_units(values)):
        listed += [
            EulerAngles(transposed, axes, True, (i, j, k), unit)
            for axes in _axes()
            for i, j, k in permutations(range(3))
        ]
        listed.append(RotationVector(transposed, unit))
    return listed


def angle_units(values: np.ndarray) -> Sequence[AngleUnit]:
    """Units that angles (N, 3) can have by their magnitude."""
    return ("deg",) if np.abs(values).max(initial=0.0) > _LARGEST_RAD else ("rad", "deg")


def _axes() -> list[str]:
    """The twelve sequences of axes of which no two that follow each other are equal."""
    return [a + b + c for a, b, c in product("xyz", repeat=3) if a != b != c]


def _all_sequences() -> list[str]:
    every = [f"{axes}-{frame}" for axes in _axes() for frame in ("intrinsic", "extrinsic")]
    return [*_USUAL, *(name for name in every if name not in _USUAL)]
