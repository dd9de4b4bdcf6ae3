"""Timed joint positions on disk: CSV, and the YAML of a ROS message trajectory_msgs/JointTrajectory."""

from __future__ import annotations

from collections.abc import Iterator
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
    """`position`, `velocity`, and where there are any `acceleration` and `effort` (N, n), of joints with these URDF names at `time` (N,).

    Units are s, rad or m, N m or N.
    """

    joint_names: tuple[str, ...]
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray | None = None
    effort: np.ndarray | None = None

    def rounded(self) -> TimedPositions:
        """As it is written."""
        return replace(
            self,
            time=np.round(self.time, _DECIMALS),
            **{name: np.round(values, _DECIMALS) + 0.0 for name, values in self._quantities().items()},
        )

    def write_csv(self, path: Path) -> None:
        """Columns t, q1…, dq1… and, where there are any, ddq1…, tau1…, in the URDF's order of the joints, atomically."""
        columns = {"t": self.time}
        short = {"position": "q", "velocity": "dq", "acceleration": "ddq", "effort": "tau"}
        for quantity, values in self._quantities().items():
            names = standard_columns(short[quantity], values.shape[1])
            columns |= {name: values[:, j] for j, name in enumerate(names)}
        write_table(path, columns)

    def write_ros(self, path: Path) -> None:
        """The message of ROS 2, as `ros2 topic pub` takes it, atomically."""
        write_text(path, self._message())

    def _quantities(self) -> dict[str, np.ndarray]:
        names = ("position", "velocity", "acceleration", "effort")
        return {name: values for name in names if (values := getattr(self, name)) is not None}

    def _message(self) -> Iterator[str]:
        plural = {
            "position": "positions",
            "velocity": "velocities",
            "acceleration": "accelerations",
            "effort": "effort",
        }
        quantities = {plural[name]: values.tolist() for name, values in self._quantities().items()}
        seconds, nanoseconds = np.divmod(np.rint(self.time * _NANO).astype(np.int64), _NANO)
        yield yaml_text({"joint_names": list(self.joint_names)}) + "points:\n"
        for row, (sec, nanosec) in enumerate(zip(seconds.tolist(), nanoseconds.tolist(), strict=True)):
            fields = (
                f"{name}: [{', '.join(f'{value:.{_DECIMALS}f}' for value in values[row])}]"
                for name, values in quantities.items()
            )
            yield f"- {{{', '.join(fields)}, time_from_start: {{sec: {sec}, nanosec: {nanosec}}}}}\n"
