"""What springs that yield, and errors of springs and geometry, change of a rigid arm's torques along one recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexcal.dynamics.drive_terms import Column, Memory
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.rows import Experiment
from flexcal.model import RobotModel
from flexcal.model.declared import uncertain_inertials
from flexcal.model.names import GEOMETRY, SPRINGS
from flexcal.model.periodic_torque import yielding_torque

YIELD = "arm_yield"
"""Name of the column of what the springs change, whose coefficient is one."""
_RATE_HZ = 50.0
"""Instants a second at which it is evaluated, between which it is interpolated."""
_SMOOTH_HZ, _ORDER = 8.0, 4
"""Cut-off and order of the low-pass, forwards and backwards, of deflections before they are differentiated twice."""
_LOWEST = 0.2
"""The cut-off over the sampling rate, at most."""
_PASSES = 3
"""Orders of load over stiffness that deflections are right to."""
_STEP = 1e-2
"""Of the central differences, in standard deviations' units of 1e-3 rad and m, and of the logarithm of a stiffness."""
_SMALL = 1e-3


def error_sources(model: RobotModel) -> tuple[str, ...]:
    """Geometric errors of the joints, and of an elastic robot stiffnesses and what weighs on them: masses and centres of mass of links."""
    springs = (f"{e.name}.{SPRINGS[c]}.stiffness" for e in model.elastic for c in sorted(e.components))
    weights = uncertain_inertials(model, range(model.n)) if model.elastic else ()
    return (*springs, *weights, *(f"{joint}.{key}" for joint in model.joint_names for key in GEOMETRY))


def error_column(source: str) -> str:
    """Name of the column of a source of error; links have columns by the source's own name."""
    return f"{source}.error"


@dataclass(frozen=True, eq=False)
class ArmYield:
    """Columns of a drive term that holds for one recording: `arm_yield`, and one for every source of error.

    `shift` (T, n) N m is the torque of the yielding arm less that of the rigid one at the instants `time` (T,). `slopes` (T, n, s) are the
    derivatives by the `sources`, in estimation coordinates: by inertials those of the shift, for the columns of links have those of the
    rigid arm, by others those of the torque.
    """

    time: np.ndarray
    shift: np.ndarray
    slopes: np.ndarray
    sources: tuple[str, ...]

    @classmethod
    def of(
        cls, model: RobotModel, experiment: Experiment, sources: Sequence[str], payload: float | None = None
    ) -> ArmYield:
        """Along a recording, of the `model` with `payload` (kg; None: the one that it has)."""
        motion = _coarse(experiment)
        states = motion.q, motion.dq, motion.ddq
        smoothed = _Smoothed(float(motion.time[1] - motion.time[0]))

        def rigid(robot: RobotModel) -> np.ndarray:
            return yielding_torque(robot, *states, np.zeros_like, payload, passes=1)

        def torque(robot: RobotModel) -> np.ndarray:
            return yielding_torque(robot, *states, smoothed, payload, _PASSES)

        def shift(robot: RobotModel) -> np.ndarray:
            return torque(robot) - rigid(robot)

        slopes = np.zeros((*motion.q.shape, len(sources)))
        for k, name in enumerate(sources):
            value, key = model.value(name), name.rpartition(".")[2]
            changed = torque if key in ("stiffness", *GEOMETRY) else shift
            log = key in ("stiffness", "mass")
            size = _STEP if log else _STEP * _SMALL
            ends = [value * np.exp(s * size) if log else value + s * size for s in (1, -1)]
            above, below = (changed(model.with_values({name: end})) for end in ends)
            slopes[:, :, k] = (above - below) / (2 * size)
        return cls(motion.time, shift(model), slopes, tuple(sources))

    @cached_property
    def _curves(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.time, np.concatenate([self.shift[:, :, None], self.slopes], axis=2))

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """For every joint the shift, then the slopes."""
        values = self._curves(np.clip(motion.time, self.time[0], self.time[-1]))
        for k, name in enumerate((YIELD, *map(error_column, self.sources))):
            for joint in range(model.n):
                yield Column(name, joint, values[:, joint, k])


@dataclass(frozen=True)
class _Smoothed:
    """Deflections (N, d) every `step` (s), smoothed, with two derivatives (3, N, d)."""

    step: float

    def __call__(self, bent: np.ndarray) -> np.ndarray:
        from scipy.signal import butter, sosfiltfilt

        corner = min(_SMOOTH_HZ * self.step, _LOWEST)
        smooth = sosfiltfilt(butter(_ORDER, 2 * corner, output="sos"), bent, axis=0)
        first = np.gradient(smooth, self.step, axis=0)
        return np.array([smooth, first, np.gradient(first, self.step, axis=0)])


def _coarse(experiment: Experiment) -> Motion:
    """Every so many samples of an experiment, the last one among them."""
    whole = Motion.joined(experiment.blocks())
    stride = max(1, int(1.0 / (_RATE_HZ * float(whole.time[1] - whole.time[0]))))
    some = slice((len(whole) - 1) % stride, None, stride)
    return Motion(whole.time[some], whole.q[some], whole.dq[some], whole.ddq[some], whole.torque[some])
