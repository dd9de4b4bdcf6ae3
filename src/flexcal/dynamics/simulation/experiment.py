"""Recording with the simulated motion of a model under control, free of measurement noise (Janot et al. 2014)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.recordings import Decimation, LowPass
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import BESIDE, Experiment, Motion, differences, smoothed, stretches
from flexcal.dynamics.simulation.closed_loop import ClosedLoop, LoopReference
from flexcal.dynamics.simulation.rigid_robot import RigidRobotSimulator

_PATH = 0.1
"""Cut-off of the tracked path relative to the row rate, which keeps noise out of it."""
_TAIL = 1e-5
"""Level, relative to its start, at which the impulse response of that low-pass is cut off; sets the least length of parts between gaps."""
_LOOP = 0.5
"""Natural frequency of the loop of an unknown controller, relative to the row rate."""
_FINE = 0.2
"""Step, relative to 1/ω of an unknown controller's loop, to which simulation steps are combined; to the period of a declared one."""


@dataclass(frozen=True)
class _Part:
    """Part without gaps from `first` to `last`, s; the path is tracked through `low_pass`, None if the part is too short for it."""

    first: float
    last: float
    low_pass: LowPass | None


@dataclass(frozen=True, eq=False)
class SimulatedExperiment:
    """Simulated motion of a robot with `parameters` (p,) tracking a recording; torques, times and standstill are those of the recording.

    The path to track is the recorded one through one more low-pass, at a tenth of the rate of the rows that `decimation` makes of it; the
    torque that a declared controller is given beforehand is the measured one, through the same, and so is τ_ext. Without a controller
    the loop is critically damped, its natural frequency half that rate. Where samples are denser than the loop needs, accelerations are the
    same over several. A joint that never moves does not yield to its loads either. What lies between two gaps and is too short for that
    low-pass stays as it was recorded, and is not `reliable`. Raises `FlexcalError` as `ClosedLoop.reach` does.
    """

    observation: Observation
    parameters: np.ndarray
    experiment: Experiment
    decimation: Decimation

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.experiment.name

    @property
    def samples(self) -> int:
        """Number of samples of the recording."""
        return self.experiment.samples

    @property
    def top_speed(self) -> np.ndarray:
        """Largest speeds of the recording (n,)."""
        return self.experiment.top_speed

    @property
    def cutoff_hz(self) -> float:
        """Cut-off of the recording."""
        return self.experiment.cutoff_hz

    def blocks(self) -> Iterator[Motion]:
        """Simulated motion in consecutive parts, with the measured torques, external ones included."""
        robot = RigidRobotSimulator(self.observation, self.parameters, self.name)
        for stretch, part in zip(stretches(self.experiment.blocks()), self._parts, strict=True):
            yield from stretch if part.low_pass is None else self._simulated(stretch, robot, part.low_pass)

    def reliable(self, time: np.ndarray) -> np.ndarray:
        """Mask of instants `time` (N,), s, inside a simulated part, a period of its path's cut-off or more from either end.

        Beyond an end the low-pass takes the path to go on turned by half a turn, with the noise of the last sample and no acceleration.
        """
        inside = np.zeros(len(time), dtype=bool)
        for part in self._parts:
            if part.low_pass is not None:
                border = 1.0 / part.low_pass.cutoff_hz
                inside |= (time >= part.first + border) & (time <= part.last - border)
        return inside

    @cached_property
    def _parts(self) -> tuple[_Part, ...]:
        """Parts between gaps, in one pass."""
        parts = []
        for stretch in stretches(self.experiment.blocks()):
            first, last, samples = math.inf, 0.0, 0
            for motion in stretch:
                first, last = min(first, float(motion.time[0])), float(motion.time[-1])
                samples += len(motion)
            low_pass = None
            if samples > 1:
                step = (last - first) / (samples - 1)
                low_pass = LowPass(step, _PATH / (step * self.decimation.factor), _TAIL)
                low_pass = low_pass if low_pass.fits(samples, BESIDE) else None
            parts.append(_Part(first, last, low_pass))
        return tuple(parts)

    def _simulated(
        self, motions: Iterator[Motion], robot: RigidRobotSimulator, low_pass: LowPass
    ) -> Iterator[Motion]:
        """Simulated parts of motions without gaps; friction of the `robot` keeps its state."""
        n, rests = self.observation.model.n, self.top_speed == 0
        first = next(motions)
        step = float(first.time[1] - first.time[0])
        rows_hz = 1.0 / (step * self.decimation.factor)
        natural = 2 * math.pi * _LOOP * rows_hz
        declared = robot.model.controller
        fine = _FINE / natural if declared is None else 1.0 / declared.rate_hz
        stride = max(1, int(fine / step + 1e-9))
        loop = ClosedLoop(robot, stride * step, natural)

        def columns() -> Iterator[tuple[np.ndarray, np.ndarray]]:
            for motion in (first, *motions):
                acting = motion.net if declared is not None else motion.net - motion.torque
                yield np.hstack([motion.q, acting]), np.column_stack([motion.time, motion.net])

        done, last = 0, np.zeros((0, 3, n))
        for values, beside in smoothed(columns(), low_pass):
            x, dx, ddx = differences(values, step)
            time, torque = beside[:, 0], beside[:, 1:]
            since = (done + np.arange(len(time))) % stride
            at = np.flatnonzero(since == 0)
            targets = map(LoopReference, time[at], x[at, :n], dx[at, :n], ddx[at, :n], x[at, n:])
            reached = np.array([loop.reach(target) for target in targets]).reshape(-1, 3, n)
            states = np.concatenate([last, reached])[np.cumsum(since == 0) - 1 + len(last)]
            done, last = done + len(time), np.concatenate([last, reached])[-1:]
            later = step * since[:, None]
            ddq = states[:, 2]
            dq = states[:, 1] + later * ddq
            q = states[:, 0] + later * (states[:, 1] + 0.5 * later * ddq)
            q[:, rests], dq[:, rests], ddq[:, rests] = x[:, :n][:, rests], 0.0, 0.0
            yield Motion(time, q, dq, ddq, torque)
