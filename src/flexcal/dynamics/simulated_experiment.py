"""Recording with the simulated motion of a model under control, free of measurement noise (Janot et al. 2014)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.data.filtering import Decimation
from flexcal.data.low_pass import LowPass, TooFewSamples
from flexcal.dynamics.closed_loop import ClosedLoop, Target
from flexcal.dynamics.motion import Motion, differences, smoothed, stretches
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.rows import Experiment
from flexcal.dynamics.simulated_robot import SimulatedRobot

_PATH = 0.1
"""Cut-off of the path that is tracked, over the rate of the rows: noise enters it by so much less of their band."""
_LOOP = 0.5
"""Natural frequency of the loop of an unknown controller, over the rate of the rows."""
_FINE = 0.2
"""Over 1/ω of an unknown controller's loop, what steps of the simulation are joined to; those of a declared one to its period."""


@dataclass(frozen=True, eq=False)
class SimulatedExperiment:
    """The motion of a robot with `parameters` (p,) that tracks a recording; torques, times and standstill are those of the recording.

    The path to track is the recorded one through one more low-pass, at a tenth of the rate of the rows that `decimation` makes of it; the
    torque that a declared controller is given beforehand is the measured one, through the same, and so is τ_ext. Without a controller
    the loop is critically damped, its natural frequency half that rate. Where samples are denser than the loop needs, accelerations are the
    same over several. A joint that never moves does not yield to its loads either. What lies between two gaps and is too short for that
    low-pass stays as it was recorded. Raises `FlexcalError` as `ClosedLoop.reach` does.
    """

    observation: Observation
    parameters: np.ndarray
    experiment: Experiment
    decimation: Decimation

    @property
    def name(self) -> str:
        """That of the recording."""
        return self.experiment.name

    @property
    def samples(self) -> int:
        """Those of the recording."""
        return self.experiment.samples

    @property
    def top_speed(self) -> np.ndarray:
        """Those of the recording (n,)."""
        return self.experiment.top_speed

    def blocks(self) -> Iterator[Motion]:
        """The simulated motion in parts that follow each other, with the measured torques, the external ones among them."""
        for stretch in stretches(self.experiment.blocks()):
            recorded: list[Motion] = []
            simulated = False
            try:
                for motion in self._simulated(_kept(stretch, recorded)):
                    simulated = True
                    recorded.clear()
                    yield motion
            except TooFewSamples:
                if simulated:
                    raise
                yield from recorded

    def _simulated(self, motions: Iterator[Motion]) -> Iterator[Motion]:
        """The same of motions without gaps."""
        n, rests = self.observation.model.n, self.top_speed == 0
        first = next(motions)
        step = float(first.time[1] - first.time[0])
        robot = SimulatedRobot(self.observation, self.parameters, self.name)
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
        for values, beside in smoothed(columns(), LowPass(step, _PATH * rows_hz)):
            x, dx, ddx = differences(values, step)
            time, torque = beside[:, 0], beside[:, 1:]
            since = (done + np.arange(len(time))) % stride
            at = np.flatnonzero(since == 0)
            targets = map(Target, time[at], x[at, :n], dx[at, :n], ddx[at, :n], x[at, n:])
            reached = np.array([loop.reach(target) for target in targets]).reshape(-1, 3, n)
            states = np.concatenate([last, reached])[np.cumsum(since == 0) - 1 + len(last)]
            done, last = done + len(time), np.concatenate([last, reached])[-1:]
            later = step * since[:, None]
            ddq = states[:, 2]
            dq = states[:, 1] + later * ddq
            q = states[:, 0] + later * (states[:, 1] + 0.5 * later * ddq)
            q[:, rests], dq[:, rests], ddq[:, rests] = x[:, :n][:, rests], 0.0, 0.0
            yield Motion(time, q, dq, ddq, torque)


def _kept(motions: Iterator[Motion], kept: list[Motion]) -> Iterator[Motion]:
    """The motions, each of which is in `kept` before it is used."""
    for motion in motions:
        kept.append(motion)
        yield motion
