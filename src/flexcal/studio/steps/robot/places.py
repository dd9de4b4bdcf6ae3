"""What robot.yaml places: measured points, the payload and the instrument."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from flexcal.files.structuring import Keys
from flexcal.model.robot import RobotModel

Triple = tuple[float, float, float]
Kind = Literal["measured point", "payload", "instrument"]
BASE = "robot base"
"""Frame of the instrument in the window; robot.yaml does not name it."""


@dataclass(frozen=True)
class Place:
    """A measured point, the payload's centre of mass or the instrument, at `xyz` (mm) in `frame`.

    Parameters
    ----------
    kind : str
        What it is.
    name : str
        Name in robot.yaml; "payload" for the payload.
    frame : str
        Frame of the URDF, or `BASE`.
    xyz : tuple of float
        Position in that frame, mm.
    mass : float, optional
        Mass of the payload, kg.
    """

    kind: Kind
    name: str
    frame: str
    xyz: Triple
    mass: float | None = None

    @property
    def title(self) -> str:
        """Kind and name."""
        return "payload" if self.kind == "payload" else f"{self.kind} {self.name}"

    @property
    def keys(self) -> Keys:
        """Keys that lead to its entry of robot.yaml."""
        if self.kind == "payload":
            return ("payload",)
        return ("points" if self.kind == "measured point" else "stations", self.name)

    def entry(self) -> dict[str, Any]:
        """Its entry of robot.yaml, SI units."""
        position = {"com" if self.kind == "payload" else "xyz": _metres(self.xyz)}
        if self.kind == "instrument":
            return position | {"line_of_sight": True}
        mass = {} if self.mass is None else {"mass": self.mass}
        return {"frame": self.frame} | mass | position

    def changes(self, other: Place) -> dict[Keys, Any]:
        """Values by keys that make this place of robot.yaml the `other` one, which has the same kind and name."""
        before, after = self.entry(), other.entry()
        return {(*self.keys, key): value for key, value in after.items() if before[key] != value}

    def told_changes(self, other: Place) -> str:
        """The difference to the `other` place in words; empty without one."""
        told = []
        if other.frame != self.frame:
            told.append(f"frame {self.frame} → {other.frame}")
        if other.mass != self.mass:
            told.append(f"mass {self.mass:g} → {other.mass:g} kg")
        if other.xyz != self.xyz:
            told.append(f"{_told(self.xyz)} → {_told(other.xyz)} mm")
        return ", ".join(told)

    def row(self) -> tuple[str, str, str, str]:
        """Cells of a table: what it is, frame, position, mass."""
        return self.title, self.frame, _told(self.xyz), "" if self.mass is None else f"{self.mass:g} kg"


def places_of(model: RobotModel) -> list[Place]:
    """The places in a robot.yaml; an instrument on a hand, or one whose place is not given, has none."""
    config = model.config
    places = [
        Place("measured point", name, point.frame, _millimetres(point.xyz))
        for name, point in config.points.items()
    ]
    if config.payload is not None:
        load = config.payload
        places.append(Place("payload", "payload", load.frame, _millimetres(load.com), load.mass))
    places += [
        Place("instrument", name, BASE, _millimetres(station.in_base))
        for name, station in config.stations.items()
        if station.in_base is not None
    ]
    return places


def _told(xyz: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in xyz)})"


def _millimetres(xyz: Sequence[float]) -> Triple:
    x, y, z = (round(1000.0 * value, 6) for value in xyz)
    return x, y, z


def _metres(xyz: Sequence[float]) -> list[float]:
    return [round(value / 1000.0, 9) for value in xyz]
