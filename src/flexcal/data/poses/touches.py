"""Poses in which the tip of a tool touches a fixed point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.poses.pose_set import PoseSet
from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class Touches:
    """N poses in which the tip of a tool touches fixed points.

    Parameters
    ----------
    q : ndarray
        Motor positions (N, n) referred to the joints, rad (m where prismatic).
    touched : ndarray
        Names (N,) of the fixed points.
    pose : ndarray
        Numbers (N,) of the poses.
    payload : ndarray, optional
        Mass (N,), kg, at the declared payload's centre of mass; None for as declared in robot.yaml.
    place : tuple of str
        File and line of every touch, where it was read from a file.

    Raises
    ------
    FlexcalError
        Where shapes do not fit.
    """

    q: np.ndarray
    touched: np.ndarray
    pose: np.ndarray
    payload: np.ndarray | None = None
    place: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.q.ndim != 2:
            raise FlexcalError(
                "E-TOOL-002", f"q of touches has shape {self.q.shape}; (touches, joints) is needed."
            )
        rows = len(self.q)
        shapes = {"touched": (rows,), "pose": (rows,), "payload": (rows,)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None and np.shape(values) != shape:
                raise FlexcalError(
                    "E-TOOL-003", f"{name} of touches has shape {np.shape(values)}; {shape} is needed."
                )

    def __len__(self) -> int:
        return len(self.q)

    def label(self, row: int) -> str:
        """Name of a touch for messages: its pose, and where it stands in a file."""
        return f"pose {self.pose[row]}" + (f" ({self.place[row]})" if self.place else "")

    def as_poses(self, target: str) -> PoseSet:
        """Poses of the point `target`, without measured positions."""
        return replace(PoseSet.unmeasured(self.q, target, ""), payload=self.payload, pose=self.pose)
