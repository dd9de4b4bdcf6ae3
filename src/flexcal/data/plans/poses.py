"""Plan of poses to measure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexcal.errors import FlexcalError

OVERTRAVEL = np.deg2rad(2.0)
"""Angle, rad, by which a joint moves in one direction before it stands at a pose, for gears to lie against the flank of that direction."""


@dataclass(frozen=True, eq=False)
class PosePlan:
    """N poses to stand still in and measure.

    Parameters
    ----------
    q : ndarray
        Commanded joint positions (N, n), rad.
    payload : ndarray, optional
        Mass (N,), kg, at the declared payload's centre of mass (a single number counts for all); by default as declared in robot.yaml.
    seed : int
        Seed of the measurement, where something is drawn.
    name : str
        Name of the plan.
    pose : ndarray, optional
        Numbers (N,) of the poses; the same one again is another visit. By default counted from 1.
    approach : ndarray, optional
        Signs (N, n) of the last motion of each joint: 1 where it is to come from below, -1 from above, 0 from anywhere. The robot goes by
        way of `via`.
    kind : {"poses"}
        Kind of the plan, in files.

    Raises
    ------
    FlexcalError
        Where shapes or values do not fit together.
    """

    kind: Literal["poses"] = field(default="poses", kw_only=True)
    q: NDArray[np.float64]
    payload: NDArray[np.float64] | None = None
    seed: int = 0
    name: str = "poses"
    pose: NDArray[np.int64] | None = None
    approach: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        q = np.asarray(self.q, dtype=np.float64)
        if q.ndim != 2 or 0 in q.shape:
            raise FlexcalError(
                "E-PLAN-027", "q must be a list of poses, each a list with one angle per joint (rad)."
            )
        object.__setattr__(self, "q", q)
        if self.payload is not None:
            payload = np.asarray(self.payload, dtype=np.float64)
            if payload.shape not in ((), (q.shape[0],)):
                raise FlexcalError(
                    "E-PLAN-028", f"payload has {payload.size} masses for {q.shape[0]} poses; give one each."
                )
            if payload.min() < 0:
                raise FlexcalError(
                    "E-PLAN-029", f"the payload is {payload.min():g} kg; it must not be negative."
                )
            object.__setattr__(self, "payload", np.broadcast_to(payload, q.shape[0]).copy())
        if self.pose is not None:
            pose = np.asarray(self.pose, dtype=np.int64)
            if pose.shape != (q.shape[0],):
                raise FlexcalError(
                    "E-PLAN-030", f"pose has {pose.size} numbers for {q.shape[0]} poses; give one each."
                )
            object.__setattr__(self, "pose", pose)
        if self.approach is not None:
            approach = np.asarray(self.approach)
            if approach.shape != q.shape or not np.isin(approach, (-1, 0, 1)).all():
                raise FlexcalError(
                    "E-PLAN-035",
                    "approach must be 1, -1 or 0 for every joint of every pose: the direction of its last motion, 0 for any.",
                )
            object.__setattr__(self, "approach", approach.astype(np.int64))
        if self.seed < 0:
            raise FlexcalError("E-PLAN-031", f"the seed is {self.seed}; it must not be negative.")

    def __len__(self) -> int:
        return self.q.shape[0]

    @property
    def numbers(self) -> np.ndarray:
        """Number (N,) of every pose."""
        return np.arange(1, len(self) + 1) if self.pose is None else self.pose

    @property
    def via(self) -> np.ndarray:
        """Joint positions (N, n), rad, from which the robot moves straight to each pose: the poses themselves without an `approach`."""
        return self.q if self.approach is None else self.q - OVERTRAVEL * self.approach

    @property
    def joint_count(self) -> int:
        """Joints of the robot that the plan is for."""
        return self.q.shape[1]
