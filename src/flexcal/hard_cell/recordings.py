"""Recordings of the hard cell: multisines and exciting trajectories."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.interpolate import CubicSpline

from flexcal.data.experiments import labels
from flexcal.data.plans import MultisinePlan, TrajectoryPlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic import excitation_torque, reference_trajectory, samples_per_period
from flexcal.hard_cell.closed_loop import ENCODER_COUNTS, Command, MovingArm, moving_arm, run_loop
from flexcal.hard_cell.description import ArmDescription
from flexcal.hard_cell.multibody import build
from flexcal.hard_cell.true_parameters import HardRobot, ideal_robot

COULOMB_VELOCITY = 0.01  # rad/s: where the controller's compensation of Coulomb friction turns over


def rigid_torque(
    described: ArmDescription, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, payload: float
) -> np.ndarray:
    """Torque (N, n) N m of the motors that moves the described arm, rigid and without friction, by `q`, `dq`, `ddq` (N, n)."""
    import mujoco

    rigid = ideal_robot(replace(described, springs=np.full_like(described.springs, np.inf)))
    arm = build(rigid, payload=payload)
    data, torque = arm.data, np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(arm.mjmodel, data)
        torque[k] = data.qfrc_inverse
    return torque


def friction(described: ArmDescription, rate: np.ndarray) -> np.ndarray:
    """Viscous and Coulomb friction (N, n) N m of the described drives at rates (N, n) rad/s."""
    return described.viscous * rate + described.coulomb * np.tanh(rate / COULOMB_VELOCITY)


TORQUE_NOISE = 1.0  # N m
PHASES = 128
"""Number of phases of the slow reference motion at which its feed-forward is computed; interpolated in between."""


def multisine_recordings(
    robot: HardRobot, described: ArmDescription, plan: MultisinePlan, seed: int, threads: int
) -> Iterator[Recording]:
    """The recordings of a plan in the order pose, realisation, experiment, sign; each a function of `seed` and its label alone."""
    order = list(product(range(plan.realisations), range(len(plan.joints)), (1, -1) if plan.signs else (1,)))
    payload = _payload(described, plan.payload)
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[Future[Recording]] = deque()
        try:
            for number, pose in enumerate(plan.poses):
                moving = moving_arm(robot, pose, plan.joints, payload, plan.rate_hz)
                follow = _reference(described, plan, pose, payload)
                for place in order:
                    label = RecordingLabel(number, *place)
                    waiting.append(pool.submit(_excite, moving, follow, plan, pose, label, seed))
                    while len(waiting) > 2 * threads:
                        yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def trajectory_recordings(
    robot: HardRobot, described: ArmDescription, plan: TrajectoryPlan, seed: int
) -> Iterator[Recording]:
    """The recordings of a plan in its order."""
    if plan.kp is None or plan.kd is None:
        raise FlexcalError(
            "E-CELL-010",
            "the plan has no gains, which the cell's controller needs; add `controller: {kp: […], kd: […], rate_hz: 4000}` to robot.yaml "
            "and design it again.",
        )
    payload = _payload(described, plan.payload)
    for number, label in enumerate(labels(plan)):
        q, dq, ddq = plan.motion(number, np.arange(plan.samples_per_period) / plan.rate_hz)
        torque = rigid_torque(described, q, dq, ddq, payload) + friction(described, dq)
        command = Command(*(np.tile(x, (plan.periods, 1)) for x in (torque, q, dq)))
        moving = moving_arm(robot, q[0], range(robot.n), payload, plan.rate_hz)
        angle, asked = run_loop(moving, command, dq[0], plan.kp, plan.kd)
        rng = np.random.default_rng([seed, 1, plan.seed, number])
        noisy = asked + TORQUE_NOISE * rng.standard_normal(asked.shape)
        yield Recording(time_step=1 / plan.rate_hz, q=angle, torque=noisy, label=label)


def counted(angles: np.ndarray) -> np.ndarray:
    """Angles as the encoders count them, rad."""
    count = 2 * np.pi / ENCODER_COUNTS
    return count * np.rint(angles / count)


def _excite(
    moving: MovingArm,
    follow: Command,
    plan: MultisinePlan,
    pose: np.ndarray,
    label: RecordingLabel,
    seed: int,
) -> Recording:
    joints = list(moving.free)
    period = excitation_torque(plan, label.realisation, label.experiment, label.sign)
    added = np.tile(period[:, np.argsort(plan.joints)], (plan.periods, 1))
    command = Command(follow.torque + added, follow.angle, follow.rate)
    angle, asked = run_loop(moving, command, follow.rate[0], plan.kp[joints], plan.kd[joints])
    key = (plan.seed, label.pose, label.realisation, label.experiment, int(label.sign < 0))
    rng = np.random.default_rng([seed, 0, *key])
    q, torque = np.tile(counted(pose), (len(angle), 1)), np.zeros((len(angle), len(pose)))
    q[:, joints] = angle
    torque[:, joints] = asked + TORQUE_NOISE * rng.standard_normal(asked.shape)
    return Recording(time_step=1 / plan.rate_hz, q=q, torque=torque, start=0.0, label=label)


def _reference(described: ArmDescription, plan: MultisinePlan, pose: np.ndarray, payload: float) -> Command:
    """The slow motion of all excited joints about a pose, and the torque that would make the described robot follow it."""
    joints = sorted(plan.joints)
    samples = plan.periods * samples_per_period(plan.base_frequency_hz, 1 / plan.rate_hz)
    time = np.arange(samples) / plan.rate_hz
    turns = np.linspace(0, 1, PHASES + 1)
    moved, rate, bent = (
        np.outer(x, np.isin(np.arange(len(pose)), joints))
        for x in reference_trajectory(plan, turns / max(plan.reference_frequency_hz, 1e-9))
    )
    torque = rigid_torque(described, pose + moved, rate, bent, payload)
    torque[-1] = torque[0]
    course = CubicSpline(turns, torque, bc_type="periodic")((plan.reference_frequency_hz * time) % 1.0)
    angle, speed, _ = (np.repeat(x[:, None], len(joints), axis=1) for x in reference_trajectory(plan, time))
    everywhere = np.zeros((samples, len(pose)))
    everywhere[:, joints] = speed
    torque = (course + friction(described, everywhere))[:, joints]
    return Command(torque, pose[joints] + angle, speed)


def _payload(described: ArmDescription, planned: float | None) -> float:
    return described.payload if planned is None else planned
