"""Plays the signals of `flexcal export excitation` on a robot, and logs what `flexcal measure` needs.

    play_all("excitation", "recordings", robot, hold=Hold(gravity, kp, kd))   # torques: the robot adds nothing
    play_all("excitation", "recordings", robot)                               # positions: files of --bandwidth

`robot` is yours: `read()` gives position and velocity of the motors and their measured torque, joint side, and `write(command)` takes the
torques, or positions, and returns at the next cycle of the controller, whose rate is that of the files. `RosEffort` is one by ros2_control.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np


class Robot(Protocol):
    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...

    def write(self, command: np.ndarray) -> None: ...


@dataclass
class Hold:
    """Soft control about the reference: torques of gravity at a position, and gains, as in robot.yaml, N m/rad and N m s/rad."""

    gravity: Callable[[np.ndarray], np.ndarray]
    kp: np.ndarray
    kd: np.ndarray

    def torque(self, q: np.ndarray, dq: np.ndarray, at: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return self.gravity(q) + self.kp * (q - at) + self.kd * (dq - speed)


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / name).open() as stream:
        return list(csv.DictReader(stream))


def signal(file: Path, row: dict[str, str]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Reference, its velocity, and torque to add, sample by sample: soft start, the loop as often as it takes, soft stop."""
    with file.open() as stream:
        names = next(csv.reader(stream))
        table = np.loadtxt(stream, delimiter=",", ndmin=2)
    columns = {
        kind: [k for k, name in enumerate(names) if name.rstrip("0123456789") == kind]
        for kind in ("q", "dq", "tau")
    }
    start, loop, play = (int(row.get(key, 0)) for key in ("loop_start_row", "loop_rows", "play_rows"))
    order = np.arange(len(table))
    if play:
        middle = start + np.arange(play) % loop
        order = np.concatenate([order[:start], middle, order[start + loop :]])
    for values in table[order]:
        q, dq = values[columns["q"]], values[columns["dq"]]
        yield q, dq, values[columns["tau"]] if columns["tau"] else np.zeros_like(q)


def play(file: Path, row: dict[str, str], robot: Robot, hold: Hold | None) -> np.ndarray:
    """Play a file; the log has the time, positions, and the torque that acts from there to the next sample, as it is measured then."""
    places, torques = [], []
    for q, dq, added in signal(file, row):
        at, speed, torque = robot.read()
        places.append(at)
        torques.append(torque)
        robot.write(q if hold is None else hold.torque(q, dq, at, speed) + added)
    torques.append(robot.read()[2])
    time = np.arange(len(places)) / float(row["rate_hz"])
    return np.column_stack([time, places, torques[1:]])


def play_all(folder: str | Path, out: str | Path, robot: Robot, hold: Hold | None = None) -> None:
    """Play all signals, with the moves between poses; one log each. The robot stands in the first pose of the plan."""
    folder, out = Path(folder), Path(out)
    out.mkdir(parents=True, exist_ok=True)
    moves = (
        {row["to_pose"]: row for row in rows(folder, "moves.csv")} if (folder / "moves.csv").exists() else {}
    )
    pose = "1"
    for row in rows(folder, "manifest.csv"):
        if row["pose"] != pose:
            pose = row["pose"]
            if pose not in moves:
                raise SystemExit(f"there is no file for the move to pose {pose}: move there and go on")
            play(folder / moves[pose]["file"], moves[pose], robot, hold)
        log = play(folder / row["file"], row, robot, hold)
        joints = range(1, log.shape[1] // 2 + 1)
        header = ",".join(["t", *(f"{kind}{j}" for kind in ("q", "tau") for j in joints)])
        np.savetxt(out / row["file"], log, delimiter=",", header=header, comments="", fmt="%.9g")


class RosEffort:
    """Joints of ros2_control: `commands` of a JointGroupEffortController, and /joint_states of a joint_state_broadcaster.

    A cycle is a new message of joint states, so the update rate of the controller manager is that of the files. Over topics a cycle may be
    lost; a controller plugin that calls `signal` in its update has none of that, and reads and writes the same.
    """

    def __init__(self, node: Any, spin: Callable[[], None], joints: list[str], commands: str) -> None:
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        self._message, self._spin, self._joints = Float64MultiArray, spin, joints
        self._state: Any = None
        self._publisher = node.create_publisher(Float64MultiArray, commands, 1)
        node.create_subscription(JointState, "/joint_states", self._receive, 1)

    def _receive(self, state: Any) -> None:
        self._state = state

    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        while self._state is None:
            self._spin()
        state, self._state = self._state, None
        order = [list(state.name).index(joint) for joint in self._joints]
        position, velocity, effort = (
            np.array(x)[order] for x in (state.position, state.velocity, state.effort)
        )
        return position, velocity, effort

    def write(self, command: np.ndarray) -> None:
        self._publisher.publish(self._message(data=command.tolist()))
