"""Detection of faulty logs: saturation, inconsistent velocities, sensors without signal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.data.recordings import Recording
from flexcal.data.tables import Signal, mapped_signals
from flexcal.dynamics.signals.saturation import SaturationDetector
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE

MOVES = 1e-3
"""Least range, rad or m, of a moving joint."""
_TOGETHER = 20
"""Number of samples over which measured velocities are compared with differences of positions."""
_CONTRADICTS = 0.3
"""Largest difference, relative to the motion, of a velocity from its position's: delays of drives reach a tenth."""
_ROUNDING = 1e-9
"""Size relative to the largest below which a value is zero."""
_SLOW = 0.02
"""Share of the fastest joint's velocity below which a joint's may be noise only."""


class LogFaults:
    """Detector of faults in a log read block by block; at its end raises `InputError` for saturated torques or positions, for a constant
    torque while the robot moves, and for velocities that contradict the positions.

    Limits are looked for at the joints, and in the columns that a matrix of `signals:` mixes to joints.
    """

    def __init__(self, path: Path, model: RobotModel) -> None:
        self._path, self._model = path, model
        signals = mapped_signals(model)
        self._torques, self._positions = (_Sensors(model, signals.get(key)) for key in ("tau", "q"))
        self._rates = np.zeros((3, model.n))
        self._step = 0.0

    def add(self, recording: Recording) -> None:
        """Add the next block."""
        self._step = recording.time_step
        self._torques.add(recording.torque, recording.time_step)
        self._positions.add(recording.q, recording.time_step)
        if recording.velocity is not None:
            self._compare(recording.q, recording.velocity)

    def check(self) -> None:
        """Raise `InputError` for the first fault of the whole log."""
        moves = max(self._positions.seen[name].span for name in self._model.joint_names) >= MOVES
        widest = max(torque.span for torque in self._torques.seen.values())
        for name, torque in self._torques.seen.items():
            if moves and torque.span <= _ROUNDING * widest:
                raise InputError(
                    "E-DYN-034",
                    f"{self._path}: the torque of {name} is the same throughout; it was not measured: correct the log, or record again.",
                )
            stay = torque.stay
            if stay is not None:
                raise InputError(
                    "E-DYN-035",
                    f"{self._path}: the torque of {name} stays at its extreme {stay.value:.6g} for {stay.samples} samples; "
                    "drive or sensor saturates there: record a slower motion, or cut these rows out into files of their own.",
                )
        slides = {joint.name for joint in self._model.joints if joint.kind == "prismatic"}
        for name, position in self._positions.seen.items():
            stopped = position.cut
            if stopped is not None:
                unit = "m" if name in slides else "rad"
                raise InputError(
                    "E-DYN-036",
                    f"{self._path}: the position of {name} reaches its extreme {stopped.value:.6g} {unit} at full speed and stays "
                    f"there for {stopped.samples} samples; the encoder is clipped: record within its range.",
                )
        if moves:
            self._check_rates()

    def _compare(self, q: np.ndarray, velocity: np.ndarray) -> None:
        count = (len(q) - 1) // _TOGETHER
        ends = q[: count * _TOGETHER + 1 : _TOGETHER]
        difference = np.diff(ends, axis=0) / (_TOGETHER * self._step)
        mean = 0.5 * (velocity[:-1] + velocity[1:])[: count * _TOGETHER].reshape(count, _TOGETHER, -1).mean(
            axis=1
        )
        self._rates += [(difference**2).sum(axis=0), (difference * mean).sum(axis=0), (mean**2).sum(axis=0)]

    def _check_rates(self) -> None:
        fastest = self._rates[[0, 2]].max()
        for joint, (own, both, measured) in zip(self._model.joints, self._rates.T, strict=True):
            missed, size = own - 2 * both + measured, max(own, measured)
            if missed <= _CONTRADICTS**2 * size or size <= _SLOW**2 * fastest:
                continue
            slope = both / own if own else np.inf
            if abs(slope * DEGREE - 1) < _CONTRADICTS:
                advice = "they are in degrees a second: declare 'unit: deg/s' under `signals:`"
            elif abs(slope + 1) < _CONTRADICTS:
                advice = "their sign is the other one"
            else:
                advice = f"they are {slope:.3g} times as large, with a relative error of {np.sqrt(missed / size):.0%}"
            raise InputError(
                "E-DYN-037",
                f"{self._path}: the velocities of {joint.name} are inconsistent with its positions: {advice}; correct or remove "
                "their column.",
            )


class _Sensors:
    """Extremes of a quantity of all joints, and of the columns mixed by its `signal`, by the names of both."""

    def __init__(self, model: RobotModel, signal: Signal | None) -> None:
        self._back, self._names = np.eye(model.n), list(model.joint_names)
        if signal is not None and signal.matrix is not None and _invertible(signal.matrix):
            back = np.linalg.pinv(signal.matrix)
            mixed = np.sum(np.abs(back) > _ROUNDING * np.abs(back).max(), axis=1) > 1
            self._back = np.vstack([self._back, back[mixed]])
            self._names += [
                f"column {name}" for name, others in zip(signal.columns, mixed, strict=True) if others
            ]
        self.seen = {name: SaturationDetector() for name in self._names}

    def add(self, values: np.ndarray, time_step: float) -> None:
        """The block (N, n) that follows; an offset of the signal shifts it, but no limit."""
        for ends, column in zip(self.seen.values(), self._back @ values.T, strict=True):
            ends.add(column, time_step)


def _invertible(matrix: np.ndarray) -> bool:
    return np.linalg.matrix_rank(matrix) == matrix.shape[1]
