"""Exciting trajectory as timed joint positions from rest to rest, as a robot's controller takes them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import TimedPositions
from flexcal.design.trajectories.optimisation import TrajectoryDesign

_LONGEST = 8
"""Largest number of periods of a run-up."""
_AT_REST = 1e-6
"""Share of its largest velocity below which a motion is at rest."""


@dataclass(frozen=True, eq=False)
class TimedMotion:
    """Timed `positions` of a trajectory, periodic from `run_up` s on, and before that on the same path, slower.

    `largest_shares` are those of all its instants, of the limits that the design may use.
    """

    positions: TimedPositions
    run_up: float
    largest_shares: dict[str, float]


def timed_motion(design: TrajectoryDesign, number: int, rate_hz: float) -> TimedMotion:
    """Trajectory `number` of a plan, at rest at its first and last instant, which are 1 / `rate_hz` s apart from their neighbours.

    Run-up and run-down follow the periodic path, so that they touch nothing and leave no range, with a path velocity that grows from 0
    to 1 as a polynomial of degree 5. The run-up takes the settle periods, so that a log from the first instant on is as the plan has it;
    longer, by whole periods, where torques or accelerations ask for it. A motion that begins at rest has none.
    """
    plan, period = design.plan, 1 / design.plan.base_frequency_hz
    begin = np.abs(np.array(plan.motion(number, np.zeros(1)))[1]).max()
    fastest = np.abs(plan.motion(number, np.linspace(0, period, 200))[1]).max()
    if begin <= _AT_REST * fastest:
        return _sampled(design, number, rate_hz, 0.0, plan.duration)
    steady = (plan.periods - plan.settle_periods) * period
    periods = max(1, plan.settle_periods)
    while True:
        motion = _sampled(design, number, rate_hz, periods * period, steady)
        if max(motion.largest_shares.values()) <= 1 or periods >= _LONGEST:
            return motion
        periods += 1


def _sampled(
    design: TrajectoryDesign, number: int, rate_hz: float, ramp: float, steady: float
) -> TimedMotion:
    length = 2 * ramp + steady
    time = np.arange(int(np.ceil(length * rate_hz - 1e-9)) + 1) / rate_hz
    phase, rate, change = _phase(np.minimum(time, length), ramp, steady)
    q, dq, ddq = design.plan.motion(number, phase)
    rate, change = rate[:, None], change[:, None]
    positions = TimedPositions(
        design.model.joint_names, time, q, dq * rate, ddq * rate**2 + dq * change
    ).rounded()
    motion = np.array([positions.position, positions.velocity, positions.acceleration])
    largest = {key: float(np.abs(shares).max()) for key, shares in design.shares(motion).items()}
    return TimedMotion(positions, ramp, largest)


def _phase(time: np.ndarray, ramp: float, steady: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phase time of the periodic motion, 0 after the run-up, its rate and the derivative of that (N,), at `time` (N,), s."""
    if ramp == 0:
        return time, np.ones_like(time), np.zeros_like(time)
    length = 2 * ramp + steady
    u = np.clip(np.minimum(time, length - time) / ramp, 0.0, 1.0)
    away = ramp * (2.5 * u**4 - 3 * u**5 + u**6 - 0.5)
    rate = 10 * u**3 - 15 * u**4 + 6 * u**5
    change = 30 * u**2 * (1 - u) ** 2 / ramp
    late = time > ramp + steady / 2
    inside = np.clip(time - ramp, 0.0, steady)
    return np.where(late, inside - away, inside + away), rate, np.where(late, -change, change)
