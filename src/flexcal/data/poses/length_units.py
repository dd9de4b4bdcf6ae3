"""The unit in which points were probably written that cannot be in m."""

from __future__ import annotations

from flexcal.data.tables import UNITS

_NEAR = 0.1
"""Relative deviation of the ratio of two sizes from that of two units."""
_WORDS = {"mm": "millimetres", "cm": "centimetres", "in": "inches", "ft": "feet", "um": "micrometres"}


def unit_advice(extent: float, smallest: float, largest: float) -> str:
    """Advice on points whose extent is no `extent` in m: every unit that makes it one from `smallest` to `largest`, m; empty for none."""
    units = [unit for unit in _WORDS if smallest <= extent * UNITS["xyz"][unit] <= largest]
    words = " or ".join(_WORDS[unit] for unit in units)
    declared = " or ".join(f"'unit: {unit}'" for unit in units)
    return (
        f"these look like {words}: convert them to m, or declare {declared} under `signals:`."
        if units
        else ""
    )


def unit_of_ratio(ratio: float) -> str:
    """Advice on points whose extent is `ratio` times that of the robot's; empty where no unit makes them so large."""
    wanted = 1 / ratio
    return unit_advice(1.0, wanted * (1 - _NEAR), wanted * (1 + _NEAR)) if ratio > 0 else ""
