"""What shows that a log lies though every single value is in order: ends that are cut off, rates and torques of another kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.data import Recording
from flexcal.dynamics.cut_ends import CutEnds
from flexcal.errors import InputError
from flexcal.model import RobotModel, gravity_torque
from flexcal.units import DEGREE

_TOGETHER = 20
"""Samples over which measured rates are compared with differences of positions."""
_CONTRADICTS = 0.3
"""How far, relative to the motion, a rate may be from its position: delays of drives reach a tenth."""
_POSES = 200
"""Samples of a block whose weight is looked at."""
_TOO_WEAK = 1 / 20
"""Torques that follow less than this share of the weight are of the motors' side: gears begin beyond, currents in A do not reach it."""
_SMALL = 1 / 8
"""Of the weight's; friction may add that to torques of motors."""


class LogFaults:
    """Takes a log block by block, and raises `InputError` at its end for torques and positions that end at a sensor's limit, for
    velocities that are not those of the positions, and for torques that cannot be the joints'.
    """

    def __init__(self, path: Path, model: RobotModel) -> None:
        self._path, self._model = path, model
        self._torques = [CutEnds() for _ in range(model.n)]
        self._positions = [CutEnds() for _ in range(model.n)]
        self._rates = np.zeros((3, model.n))
        self._weight = np.zeros((3, model.n))
        self._step = 0.0

    def add(self, recording: Recording) -> None:
        """The block that follows."""
        self._step = recording.time_step
        for k in range(self._model.n):
            self._torques[k].add(recording.torque[:, k], recording.time_step)
            self._positions[k].add(recording.q[:, k], recording.time_step)
        if recording.velocity is not None:
            self._compare(recording.q, recording.velocity)
        some = slice(None, None, max(1, len(recording) // _POSES))
        weight, torque = gravity_torque(self._model, recording.q[some]), recording.torque[some]
        self._weight += [np.sum(x, axis=0) for x in (weight**2, weight * torque, torque**2)]

    def check(self) -> None:
        """Raises `InputError` for the first fault that the whole log shows."""
        for joint, torque, position in zip(self._model.joints, self._torques, self._positions, strict=True):
            unit = "m" if joint.kind == "prismatic" else "rad"
            held = torque.held
            if held is not None:
                raise InputError(
                    f"{self._path}: the torque of {joint.name} stays at its extreme {held.value:.6g} for {held.samples} samples; "
                    "drive or sensor saturate there: record a calmer motion, or cut these rows out into files of their own."
                )
            stopped = position.cut
            if stopped is not None:
                raise InputError(
                    f"{self._path}: the position of {joint.name} runs into its extreme {stopped.value:.6g} {unit} at full speed and stays "
                    f"there for {stopped.samples} samples; the encoder is clipped: record inside its range."
                )
        self._check_rates()
        self._check_weight()

    def _compare(self, q: np.ndarray, velocity: np.ndarray) -> None:
        count = (len(q) - 1) // _TOGETHER
        ends = q[: count * _TOGETHER + 1 : _TOGETHER]
        difference = np.diff(ends, axis=0) / (_TOGETHER * self._step)
        mean = 0.5 * (velocity[:-1] + velocity[1:])[: count * _TOGETHER].reshape(count, _TOGETHER, -1).mean(
            axis=1
        )
        self._rates += [(difference**2).sum(axis=0), (difference * mean).sum(axis=0), (mean**2).sum(axis=0)]

    def _check_rates(self) -> None:
        for joint, (own, both, measured) in zip(self._model.joints, self._rates.T, strict=True):
            missed = own - 2 * both + measured
            if missed <= _CONTRADICTS**2 * max(own, measured) or measured == 0:
                continue
            slope = both / own if own else np.inf
            if abs(slope * DEGREE - 1) < _CONTRADICTS:
                advice = "they are in degrees a second: declare 'unit: deg/s' under `signals:`"
            elif abs(slope + 1) < _CONTRADICTS:
                advice = "their sign is the other one"
            else:
                advice = f"they are {slope:.3g} times as large, and miss it by {np.sqrt(missed / max(own, measured)):.0%}"
            raise InputError(
                f"{self._path}: the velocities of {joint.name} are not those of its positions: {advice}; mend or remove their column."
            )

    def _check_weight(self) -> None:
        weight, both, torque = self._weight[:, np.argmax(self._weight[0])]
        share = abs(both) / weight if weight > 0 else 1.0
        if share >= _TOO_WEAK or torque >= _SMALL**2 * weight:
            return
        name = self._model.joint_names[int(np.argmax(self._weight[0]))]
        raise InputError(
            f"{self._path}: the torque of {name} follows only {share:.2%} of what its weight asks for; these look like torques "
            "of the motors: declare gear ratios as `tau: {gain: […]}` under `signals:`."
        )
