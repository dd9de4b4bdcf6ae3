"""Torque difference of an elastic arm from a rigid one along a recording, and its sensitivity to springs and geometry."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from flexcal.dynamics.inverse_model import Column, Memory
from flexcal.dynamics.signals import Experiment, Motion, stretches
from flexcal.errors import FlexcalError
from flexcal.model.robot import GEOMETRY, SPRINGS, RobotModel, uncertain_inertials
from flexcal.model.vibration import flexible_joint_torque, spring_load

YIELD = "arm_yield"
"""Name of the column of the torque change due to the springs, with unit coefficient."""
_RATE_HZ = 50.0
"""Rate at which the correction is evaluated, and interpolated in between."""
_CUTOFF_HZ, _ORDER = 10.0, 4
"""Cut-off and order of the low-pass, forwards and backwards, of the motion (deflections differentiate its noise twice more) and of the
transition between flanks of a gap.
"""
_HIGHEST = 0.4
"""Largest ratio of the cut-off to the sampling rate."""
_SHORTEST = 0.5
"""Shortest duration, s."""
_PASSES = 4
"""Order in load over stiffness to which deflections are correct."""
_STEP = 1e-2
"""Step of the central differences, in units of 1e-3 rad and m, and of the logarithm of a stiffness."""
_SMALL = 1e-3


def uncertain_parameters(model: RobotModel) -> tuple[str, ...]:
    """Uncertain parameters: geometric errors of the joints and, for an elastic robot, stiffnesses, gaps, masses and centres of mass."""
    springs = (f"{e.name}.{SPRINGS[c]}.stiffness" for e in model.elastic for c in sorted(e.components))
    weights = uncertain_inertials(model, range(model.n)) if model.elastic else ()
    backlashes = (f"{model.joint_names[i]}.backlash" for i in model.backlash_joints) if model.elastic else ()
    return (
        *springs,
        *backlashes,
        *weights,
        *(f"{joint}.{key}" for joint in model.joint_names for key in GEOMETRY),
    )


def error_column(source: str) -> str:
    """Name of the column of an error source; columns of links have the source's own name."""
    return f"{source}.error"


@dataclass(frozen=True, eq=False)
class FlexibilityCorrection:
    """Columns of a drive term that holds for one recording: `arm_yield`, and one for every source of error.

    `shift` (T, n) N m is the torque of the yielding arm less that of the rigid one at the instants `time` (T,). `slopes` (T, n, s) are the
    derivatives by the `sources`, in estimation coordinates: by inertials those of the shift, for the columns of links have those of the
    rigid arm, by others those of the torque. Where the recording has gaps, stretches of it begin at the indices `starts`.
    """

    time: np.ndarray
    shift: np.ndarray
    slopes: np.ndarray
    sources: tuple[str, ...]
    starts: tuple[int, ...] = (0,)

    @classmethod
    def of(
        cls, model: RobotModel, experiment: Experiment, sources: Sequence[str], payload: float | None = None
    ) -> FlexibilityCorrection:
        """Correction along a recording, for `model` with `payload` (kg; None: its own), which determines the flanks of the drives.

        Stretches of less than half a second are left out; raises `FlexcalError` where there is no longer one.
        """
        each = [cls._along(model, motion, sources, payload) for motion in _slow(experiment)]
        time, shift, slopes = (
            np.concatenate([getattr(part, name) for part in each]) for name in ("time", "shift", "slopes")
        )
        starts = np.cumsum([0, *(len(part.time) for part in each[:-1])])
        return cls(time, shift, slopes, tuple(sources), tuple(int(start) for start in starts))

    @classmethod
    def _along(
        cls, model: RobotModel, motion: Motion, sources: Sequence[str], payload: float | None
    ) -> FlexibilityCorrection:
        states, course = (motion.q, motion.dq, motion.ddq), _Course(motion.time)
        flanks = None
        if model.elastic:
            flanks = course.between(np.sign(spring_load(model, *states, course, payload)))

        def rigid(robot: RobotModel) -> np.ndarray:
            return flexible_joint_torque(robot, *states, np.zeros_like, payload, passes=1)

        def torque(robot: RobotModel) -> np.ndarray:
            return flexible_joint_torque(robot, *states, course, payload, _PASSES, flanks)

        def shift(robot: RobotModel) -> np.ndarray:
            return torque(robot) - rigid(robot)

        slopes = np.zeros((*motion.q.shape, len(sources)))
        for k, name in enumerate(sources):
            value, key = model.value(name), name.rpartition(".")[2]
            changed = torque if key in ("stiffness", "backlash", *GEOMETRY) else shift
            log = key in ("stiffness", "mass")
            size = _STEP if log else _STEP * _SMALL
            ends = [value * np.exp(s * size) if log else value + s * size for s in (1, -1)]
            above, below = (changed(model.with_values({name: end})) for end in ends)
            slopes[:, :, k] = (above - below) / (2 * size)
        return cls(motion.time, shift(model), slopes, tuple(sources))

    @cached_property
    def _curves(self) -> list[Any]:
        """Correction curves of every stretch."""
        from scipy.interpolate import CubicSpline

        values = np.concatenate([self.shift[:, :, None], self.slopes], axis=2)
        edges = pairwise((*self.starts, len(self.time)))
        return [CubicSpline(self.time[start:end], values[start:end]) for start, end in edges]

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """Shift, then slopes, of every joint."""
        stretch = max(0, int(np.searchsorted(self.time[list(self.starts)], motion.time[0], side="right")) - 1)
        curves = self._curves[stretch]
        values = curves(np.clip(motion.time, curves.x[0], curves.x[-1]))
        for k, name in enumerate((YIELD, *map(error_column, self.sources))):
            for joint in range(model.n):
                yield Column(name, joint, values[:, joint, k])


@dataclass(frozen=True)
class _Course:
    """Values (N, d) at the instants `time` (N,) s, with their first and second derivative (3, N, d)."""

    time: np.ndarray

    def __call__(self, values: np.ndarray) -> np.ndarray:
        from scipy.interpolate import make_interp_spline

        curve = make_interp_spline(self.time, values, k=5)
        return np.array([curve(self.time, nu=order) for order in range(3)])

    def between(self, flanks: np.ndarray) -> np.ndarray:
        """Transition from one flank, ±1, to the other, low-passed."""
        return self(_low_passed(flanks, float(self.time[1] - self.time[0])))


def _slow(experiment: Experiment) -> list[Motion]:
    """Low-passed values of every stretch of an experiment, decimated, the last sample included."""
    slow_parts, longest = [], 0.0
    for stretch in stretches(experiment.blocks()):
        whole = Motion.joined(stretch)
        step = float(whole.time[1] - whole.time[0]) if len(whole) > 1 else 0.0
        longest = max(longest, len(whole) * step)
        if len(whole) * step < _SHORTEST:
            continue
        stride = max(1, int(1.0 / (_RATE_HZ * step)))
        some = slice((len(whole) - 1) % stride, None, stride)
        q, dq, ddq = (_low_passed(values, step)[some] for values in (whole.q, whole.dq, whole.ddq))
        slow_parts.append(Motion(whole.time[some], q, dq, ddq, whole.torque[some]))
    if not slow_parts:
        raise FlexcalError(
            "E-DYN-019", f"{experiment.name}: {longest:.2g} s of motion are too short; record for longer."
        )
    return slow_parts


def _low_passed(values: np.ndarray, step: float) -> np.ndarray:
    """Values (N, ·) every `step` (s) below `_CUTOFF_HZ`, without phase shift."""
    from scipy.signal import butter, sosfiltfilt

    return sosfiltfilt(butter(_ORDER, 2 * min(_CUTOFF_HZ * step, _HIGHEST), output="sos"), values, axis=0)
