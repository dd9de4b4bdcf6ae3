"""The unit in which points were probably written that cannot be in m."""

from __future__ import annotations

from flexcal.data.tables import UNITS

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
