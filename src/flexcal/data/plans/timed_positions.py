"""Timed joint positions on disk: CSV, and a ROS message trajectory_msgs/JointTrajectory as YAML or in an MCAP file."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import standard_columns, write_table
from flexcal.errors import InputError
from flexcal.files.formats import yaml_text
from flexcal.files.transaction import atomic_path, write_text

_DECIMALS = 9
_NANO = 10**9
_FIELDS = {
    "position": "positions",
    "velocity": "velocities",
    "acceleration": "accelerations",
    "effort": "effort",
}
"""Fields of the message's points."""
_MESSAGE = "trajectory_msgs/msg/JointTrajectory"
TOPIC = "/joint_trajectory_controller/joint_trajectory"
"""Topic of the message in an MCAP file: where a trajectory controller of ros2_control takes it."""


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
        """The message of ROS 2, as `ros2 topic pub` takes it, or in an .mcap file, as `ros2 bag play` does, atomically.

        Raises `InputError` for an .mcap file where rosbags is not installed.
        """
        if path.suffix == ".mcap":
            self._write_mcap(path)
        else:
            write_text(path, self._message())

    def _quantities(self) -> dict[str, np.ndarray]:
        return {name: values for name in _FIELDS if (values := getattr(self, name)) is not None}

    def _from_start(self) -> list[tuple[int, int]]:
        """Seconds and nanoseconds of every point."""
        return [divmod(int(at), _NANO) for at in np.rint(self.time * _NANO)]

    def _message(self) -> Iterator[str]:
        quantities = {_FIELDS[name]: values.tolist() for name, values in self._quantities().items()}
        yield yaml_text({"joint_names": list(self.joint_names)}) + "points:\n"
        for row, (sec, nanosec) in enumerate(self._from_start()):
            fields = (
                f"{name}: [{', '.join(f'{value:.{_DECIMALS}f}' for value in values[row])}]"
                for name, values in quantities.items()
            )
            yield f"- {{{', '.join(fields)}, time_from_start: {{sec: {sec}, nanosec: {nanosec}}}}}\n"

    def _write_mcap(self, path: Path) -> None:
        try:
            from rosbags.rosbag2 import StoragePlugin, Writer
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise InputError("E-EXP-030", f"{path}: MCAP files need rosbags: pip install rosbags.") from None
        store = get_typestore(Stores.ROS2_HUMBLE)
        kinds, none = store.types, np.empty(0)
        stamp, duration = kinds["builtin_interfaces/msg/Time"](0, 0), kinds["builtin_interfaces/msg/Duration"]
        columns = [self._quantities().get(name) for name in _FIELDS]
        points: list[Any] = [
            kinds["trajectory_msgs/msg/JointTrajectoryPoint"](
                *(none if values is None else values[row] for values in columns), duration(*at)
            )
            for row, at in enumerate(self._from_start())
        ]
        header = kinds["std_msgs/msg/Header"](stamp, "")
        message = store.serialize_cdr(kinds[_MESSAGE](header, list(self.joint_names), points), _MESSAGE)
        with tempfile.TemporaryDirectory() as folder, atomic_path(path) as temporary:
            with Writer(Path(folder) / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
                bag.write(bag.add_connection(TOPIC, _MESSAGE, typestore=store), 0, message)
            shutil.copyfile(Path(folder) / "bag" / "bag.mcap", temporary)
