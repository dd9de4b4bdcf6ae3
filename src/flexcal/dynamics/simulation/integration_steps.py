"""Quantities of the direct dynamic model along short steps of a motion, linear in the parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.inverse_model import Memory, Observation
from flexcal.dynamics.signals import Experiment, Motion, Window, stretches

_STEP = 2e-3
"""Longest step, s, unless samples are farther apart."""
_TOGETHER = 400
"""Number of steps in memory at once."""
_PUSH = 1e-3
"""Step in acceleration, rad/s², for the mass matrix: torques are linear in it, but for load-dependent friction."""
_SHIFT = 1e-6
"""Step in state, rad and rad/s, for derivatives of the torques."""


@dataclass(frozen=True, eq=False)
class IntegrationSteps:
    """Consecutive steps of `length` h (s), each with midpoint values as means of its samples.

    Samples are `spacing` (s) apart. `torque` (N, n), the external one included, and `state` (N, 2, n), q and q̇; `columns` (N, n, p) are W
    with the measured accelerations of `middle`, and `inertia` (N, n, n, p) its derivative by each: M = inertia χ. `still` (N,) marks steps
    in which the robot stands; `begins` says that a gap precedes them, or nothing; `before` and `after` (N, n) are the positions measured at
    their ends, `speed` (N, n) the velocity at the start.
    """

    length: float
    spacing: float
    torque: np.ndarray
    state: np.ndarray
    columns: np.ndarray
    inertia: np.ndarray
    still: np.ndarray
    begins: bool
    before: np.ndarray
    after: np.ndarray
    speed: np.ndarray
    observation: Observation
    middle: Motion
    memory: Memory

    def slopes(self, parameters: np.ndarray) -> np.ndarray:
        """Derivative of the torques by q and by q̇ (2, N, n, n) at `parameters` (p,), by differences."""
        derivatives = np.zeros((2, len(self.torque), *2 * self.torque.shape[1:]))
        at = self._torques(self.middle, parameters)
        for joint in range(self.torque.shape[1]):
            shift = _SHIFT * (np.arange(self.torque.shape[1]) == joint)
            moved = (
                replace(self.middle, q=self.middle.q + shift),
                replace(self.middle, dq=self.middle.dq + shift),
            )
            for kind, motion in enumerate(moved):
                derivatives[kind, :, :, joint] = (self._torques(motion, parameters) - at) / _SHIFT
        return derivatives

    def _torques(self, motion: Motion, parameters: np.ndarray) -> np.ndarray:
        return columns(self.observation, motion, dict(self.memory)) @ parameters


def discretise_motion(
    observation: Observation, experiment: Experiment, window: Window, slowest: np.ndarray
) -> Iterator[IntegrationSteps]:
    """Steps of an experiment inside a window, some at a time; a robot slower than `slowest` (n,) at all joints stands still.

    Friction that remembers does so from the start of the experiment on.
    """
    memory: Memory = {}
    for stretch in stretches(experiment.blocks()):
        pending: Motion | None = None
        begins = True
        for block in stretch:
            first, last = np.searchsorted(block.time, [window.start, window.end])
            if first:
                observation.follow(block.part(0, first), memory)
            if first == last:
                continue
            motion = block.part(first, last)
            motion = motion if pending is None else Motion.joined([pending, motion])
            stride = (
                max(1, int(_STEP / float(motion.time[1] - motion.time[0]) + 1e-6)) if len(motion) > 1 else 1
            )
            count = (len(motion) - 1) // stride
            for start in range(0, count, _TOGETHER):
                stop = min(start + _TOGETHER, count)
                part = motion.part(start * stride, stop * stride + 1)
                yield replace(_steps(observation, part, stride, memory, slowest), begins=begins)
                begins = False
            pending = motion.part(count * stride, len(motion))


def columns(observation: Observation, motion: Motion, memory: Memory) -> np.ndarray:
    """Observation matrix W (N, n, p) of all columns."""
    regressor = np.zeros((len(motion), observation.model.n, len(observation.names)))
    systems = observation.systems(motion, memory)
    for joint, (system, column_indices) in enumerate(zip(systems, observation.column_indices, strict=True)):
        regressor[:, joint, column_indices] = system[:-1].T
    return regressor


def _steps(
    observation: Observation, motion: Motion, stride: int, memory: Memory, slowest: np.ndarray
) -> IntegrationSteps:
    middle = Motion(
        _means(motion.time, stride),
        _means(motion.q, stride),
        _means(motion.dq, stride),
        _means(motion.ddq, stride),
        _means(motion.net, stride),
    )
    before = dict(memory)
    sampled = columns(observation, motion, memory)
    whole = columns(observation, middle, dict(before))
    n = observation.model.n
    inertia = np.empty((len(middle), n, n, len(observation.names)))
    for joint in range(n):
        pushed = replace(middle, ddq=middle.ddq + _PUSH * (np.arange(n) == joint))
        inertia[:, :, joint] = (columns(observation, pushed, dict(before)) - whole) / _PUSH
    still = np.abs(motion.dq) <= slowest
    stands = [bool(still[k : k + stride + 1].all(axis=1).any()) for k in range(0, len(motion) - 1, stride)]
    spacing = float(motion.time[1] - motion.time[0])
    at = slice(None, None, stride)
    return IntegrationSteps(
        stride * spacing,
        spacing,
        middle.torque,
        np.stack([middle.q, middle.dq], axis=1),
        _means(sampled, stride),
        inertia,
        np.array(stands),
        False,
        motion.q[at][:-1],
        motion.q[at][1:],
        motion.dq[at][:-1],
        observation,
        middle,
        before,
    )


def _means(values: np.ndarray, stride: int) -> np.ndarray:
    """Mean over each step by the trapezoidal rule."""
    pairs = 0.5 * (values[1:] + values[:-1])
    return pairs.reshape(-1, stride, *values.shape[1:]).mean(axis=1)
