"""Tables of exported parameters for people, in degrees and millimetres."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, remainder
from typing import Any

from rich.table import Table

from flexcal.units import DEGREE, MILLIMETRE

_LENGTHS = ("a", "d", "x", "y", "z")


def dh_table(document: Mapping[str, Any]) -> Table:
    """One row a joint: its calibrated parameters, below each its change from nominal and its standard deviation."""
    title = f"{document['convention']} Denavit-Hartenberg: calibrated, (change), ± std"
    table = Table(title=title, title_justify="left")
    table.add_column("joint")
    keys = list(next(iter(document["joints"].values()))["calibrated"])
    for key in keys:
        table.add_column(f"{key} {'mm' if key in _LENGTHS else '°'}", justify="right")
    for name, row in document["joints"].items():
        new, old, std = row["calibrated"], row["nominal"], row["std"]
        lines = (
            (
                _shown(key, new[key]),
                f"({_change(key, new[key] - old[key])})",
                "not determined" if key in row["undetermined"] else _spread(key, std),
            )
            for key in keys
        )
        table.add_row(name, *("\n".join(filter(None, cell)) for cell in lines))
    return table


def offset_table(document: Mapping[str, Any]) -> Table:
    """One row a joint: its offset, standard deviation, and the offset at the motor."""
    table = Table(title="joint offsets", title_justify="left")
    table.add_column("joint")
    for heading in ("offset", "std", "at the motor"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for name, row in document["joints"].items():
        unit, scale = ("mm", MILLIMETRE) if row["unit"] == "m" else ("°", DEGREE)
        cells = [
            "" if value is None else f"{value / scale:.5f}"
            for value in (row["offset"], row["std"], row["motor_offset"])
        ]
        if not row["determined"]:
            cells[1] = "not determined"
        table.add_row(name, *cells, unit)
    return table


def frame_table(frames: Mapping[str, Mapping[str, float]]) -> Table:
    """One row a frame that goes with the joints' parameters: position, and roll, pitch and yaw where it is turned."""
    table = Table(title="with these frames", title_justify="left")
    table.add_column("")
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    for key in keys:
        table.add_column(f"{key} {'mm' if key in _LENGTHS else '°'}", justify="right")
    for name, numbers in frames.items():
        table.add_row(name, *(_shown(key, numbers[key]) if key in numbers else "" for key in keys))
    return table


def _shown(key: str, value: float) -> str:
    return f"{value / MILLIMETRE:z.3f}" if key in _LENGTHS else f"{value / DEGREE:z.4f}"


def _change(key: str, value: float) -> str:
    return f"{value / MILLIMETRE:+z.3f}" if key in _LENGTHS else f"{remainder(value, 2 * pi) / DEGREE:+z.4f}"


def _spread(key: str, std: Mapping[str, float] | None) -> str:
    return "" if std is None or not std[key] else f"± {_shown(key, std[key])}"
