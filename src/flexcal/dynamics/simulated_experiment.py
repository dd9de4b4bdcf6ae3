"""A recording with the motion that a model makes of it under control: what of the motion is not noise (Janot et al. 2014)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.data.filtering import Decimation
from flexcal.data.low_pass import LowPass
from flexcal.dynamics.closed_loop import ClosedLoop, Target
from flexcal.dynamics.motion import Motion, differences, smoothed
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.rows import Experiment
from flexcal.dynamics.simulated_robot import SimulatedRobot

_PATH = 0.1
"""Cut-off of the path that is tracked, over the rate of the rows: noise enters it by so much less of their band."""
_LOOP = 0.5
"""Natural frequency of the loop of an unknown controller, over the rate of the rows."""


@dataclass(frozen=True, eq=False)
class SimulatedExperiment:
    """The motion of a robot with `parameters` (p,) that tracks a recording; torques, times and standstill are those of the recording.

    The path to track is the recorded one through one more low-pass, at a tenth of the rate of the rows that `decimation` makes of it; the
    torque that a declared controller is given beforehand is the measured one, through the same. Without a controller the loop is
    critically damped, its natural frequency half that rate. A joint that never moves does not yield to its loads either. Raises
    `FlexcalError` as `ClosedLoop.reach` does.
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
        """The simulated motion in parts that follow each other, with the measured torques."""
        n, rests = self.observation.model.n, self.top_speed == 0
        motions = iter(self.experiment.blocks())
        first = next(motions)
        step = float(first.time[1] - first.time[0])
        robot = SimulatedRobot(self.observation, self.parameters, self.name)
        rows_hz = 1.0 / (step * self.decimation.factor)
        loop = ClosedLoop(robot, step, 2 * math.pi * _LOOP * rows_hz)

        def columns() -> Iterator[tuple[np.ndarray, np.ndarray]]:
            for motion in (first, *motions):
                yield np.hstack([motion.q, motion.torque]), np.column_stack([motion.time, motion.torque])

        for values, beside in smoothed(columns(), LowPass(step, _PATH * rows_hz)):
            x, dx, ddx = differences(values, step)
            time, torque = beside[:, 0], beside[:, 1:]
            targets = map(Target, time, x[:, :n], dx[:, :n], ddx[:, :n], x[:, n:])
            states = np.array([loop.reach(target) for target in targets])
            states[:, :, rests] = np.stack([x[:, :n], 0 * dx[:, :n], 0 * dx[:, :n]], axis=1)[:, :, rests]
            yield Motion(time, states[:, 0], states[:, 1], states[:, 2], torque)
