"""Timed joint positions on disk: CSV, and the YAML of a ROS message trajectory_msgs/JointTrajectory."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexcal.data.tables import standard_columns, write_table
from flexcal.files.formats import yaml_text
from flexcal.files.transaction import write_text

_DECIMALS = 9
_NANO = 10**9


@dataclass(frozen=True, eq=False)
class TimedPositions:
    """`position`, `velocity`, `acceleration` (N, n) of joints with these URDF names at `time` (N,), s; rad or m."""

    joint_names: tuple[str, ...]
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray

    def rounded(self) -> TimedPositions:
        """As it is written."""
        columns = {key: np.round(getattr(self, key), _DECIMALS) for key in ("time", "position", "velocity")}
        return replace(self, **columns, acceleration=np.round(self.acceleration, _DECIMALS))

    def write_csv(self, path: Path) -> None:
        """Columns t, q1…, dq1…, ddq1…, in the URDF's order of the joints, atomically."""
        columns = {"t": self.time}
        for quantity, values in (("q", self.position), ("dq", self.velocity), ("ddq", self.acceleration)):
            names = standard_columns(quantity, values.shape[1])
            columns |= {name: values[:, j] for j, name in enumerate(names)}
        write_table(path, columns)

    def write_ros(self, path: Path) -> None:
        """The message of ROS 2, as `ros2 topic pub` takes it, atomically."""
        whole = np.rint(self.time * _NANO).astype(np.int64)
        rows = zip(
            self.position.tolist(),
            self.velocity.tolist(),
            self.acceleration.tolist(),
            *(part.tolist() for part in np.divmod(whole, _NANO)),
            strict=True,
        )
        points = [
            {
                "positions": q,
                "velocities": dq,
                "accelerations": ddq,
                "time_from_start": {"sec": sec, "nanosec": nanosec},
            }
            for q, dq, ddq, sec, nanosec in rows
        ]
        write_text(path, yaml_text({"joint_names": list(self.joint_names), "points": points}))
