"""Target poses of the tool."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class ToolTargets:
    """N targets for the tool of an n-joint robot, one per row.

    Parameters
    ----------
    pose : ndarray
        Numbers (N,) of the targets, each once.
    target : ndarray
        Names (N,) of the points that are to be there.
    q : ndarray, optional
        Nominal commands (N, n), rad or m. Without `position` the target is where the nominal robot's point is with these.
    position : ndarray, optional
        Positions (N, 3), m, in the robot's base frame, or in that of the instrument at `station`.
    rotation : ndarray, optional
        Rotation matrices (N, 3, 3) of the point's frame, in the same frame.
    station : ndarray, optional
        Names (N,) of the instrument's places.
    payload : ndarray, optional
        Mass (N,), kg, at the declared payload's centre of mass; by default as declared in robot.yaml.
    temperature : ndarray, optional
        Temperature (N,) of the arm, °C; by default that at which the calibrated parameters hold.
    approach : ndarray, optional
        Signs (N, n) of the joints' last motions, 1 or -1, 0 where they are not known; by default none is.

    Raises
    ------
    FlexcalError
        Where shapes do not fit, and where there is neither `q` nor `position`.
    """

    pose: np.ndarray
    target: np.ndarray
    q: np.ndarray | None = None
    position: np.ndarray | None = None
    rotation: np.ndarray | None = None
    station: np.ndarray | None = None
    payload: np.ndarray | None = None
    temperature: np.ndarray | None = None
    approach: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.q is None and self.position is None:
            raise FlexcalError("E-POSES-032", "targets need joint positions or points; give q or position.")
        if self.position is None and (self.rotation is not None or self.station is not None):
            raise FlexcalError(
                "E-POSES-033", "an orientation or a station of targets needs points; give position."
            )
        rows = len(self.pose)
        shapes: dict[str, tuple[int, ...]] = {
            "target": (rows,),
            "position": (rows, 3),
            "rotation": (rows, 3, 3),
            "station": (rows,),
            "payload": (rows,),
            "temperature": (rows,),
        }
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                raise FlexcalError(
                    "E-POSES-034", f"{name} of targets has shape {values.shape}; {shape} is needed."
                )
        for name, values in (("q", self.q), ("approach", self.approach)):
            if values is not None and (values.ndim != 2 or len(values) != rows):
                raise FlexcalError(
                    "E-POSES-035", f"{name} of targets has shape {values.shape}; ({rows}, joints) is needed."
                )

    def __len__(self) -> int:
        return len(self.pose)

    def subset(self, rows: np.ndarray | slice) -> ToolTargets:
        """Some of the targets, in their order.

        Parameters
        ----------
        rows : ndarray or slice
            Indices, or a mask (N,).

        Returns
        -------
        ToolTargets
            The targets of these rows.
        """
        changed: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        changed |= {name: values[rows] for name, values in changed.items() if values is not None}
        return ToolTargets(**changed)
