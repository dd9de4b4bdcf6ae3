"""Columns of the measured pose of a moving base, and of inclinometers, by their names."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.data.tables import VECTORS
from flexcal.importing.tables import BASE, NEUTRAL, POINT, TILT, ColumnName

TILTS = ("tilt_x", "tilt_y", "tilt_z")


def base_columns(names: Sequence[ColumnName]) -> dict[str, tuple[str, ...]]:
    """Columns of the base's position and quaternion; none unless all are there, for points are often called after the base frame."""
    found: dict[str, str] = {}
    for name in names:
        parts = [word for word in name.words if word not in BASE | NEUTRAL]
        if set(name.words) & BASE and len(parts) == 1 and name.number is None:
            found.setdefault(f"base_{POINT.get(parts[0], parts[0])}", name.column)
    quantities = ("base_xyz", "base_quaternion")
    if not all(column in found for quantity in quantities for column in VECTORS[quantity]):
        return {}
    return {quantity: tuple(found[column] for column in VECTORS[quantity]) for quantity in quantities}


def tilt_columns(names: Sequence[ColumnName]) -> dict[str, tuple[str, ...]]:
    """Columns of the axes of an inclinometer."""
    tilts: dict[str, tuple[str, ...]] = {}
    for name in names:
        words = set(name.words) - NEUTRAL
        axes = [word for word in name.words if word in ("x", "y", "z")]
        if words & TILT and len(axes) == 1 and not words - TILT - set(axes):
            tilts.setdefault(f"tilt_{axes[0]}", (name.column,))
    return tilts
