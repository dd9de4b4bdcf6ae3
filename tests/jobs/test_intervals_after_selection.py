"""Intervals after a selection of friction terms hold the truth: true Stribeck friction is so small that only some logs show it."""

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from planar_arm import TRUTH, Log, stribeck, swings, torque
from scipy.stats import t as student

from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import Motion
from flexcal.jobs.dynamics import DynamicsIdentification, identify_robot_dynamics

STATES = 40
LINKS = ("mass", "mc_x", "mc_z", "Iyy", "rotor_inertia", "torque_offset")


def inside(found: DynamicsIdentification, seed: int, log: Log) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which 95 % intervals hold the truth: of torques and friction torques in a motion of the same kind, and of other base parameters."""
    estimate, observation = found.estimate, found.train.observation
    assert isinstance(observation, Observation)
    rng = np.random.default_rng(5000 + seed)
    _, q, dq, ddq = swings(10.0, STATES / 10, log.fundamental, rng)
    still = np.zeros_like(q)
    friction = stribeck(dq, log.stribeck, log.velocity)
    drives = [[TRUTH[f"j{joint}.{key}"] for joint in (1, 2)] for key in ("viscous", "coulomb")]
    plain = drives[0] * dq + drives[1] * np.sign(dq)
    moved, gliding, rest = (
        observation.columns(Motion(np.arange(float(STATES)), q, speed, acceleration, still))
        for speed, acceleration in ((dq, ddq), (dq, still), (still, still))
    )
    quantile, x = student.ppf(0.975, estimate.covariance_freedom), estimate.parameters.coordinates()
    torques, frictions = [], []
    for joint, members in enumerate(observation.column_indices):
        driven = np.array([observation.names[number].startswith("j") for number in members])
        glides = np.where(driven[:, None], gliding[joint] - rest[joint], 0.0)
        covariance = estimate.covariance[np.ix_(members, members)]
        for columns, truth, held in (
            (moved[joint], (torque(q, dq, ddq) + friction)[:, joint], torques),
            (glides, (plain + friction)[:, joint], frictions),
        ):
            std = np.sqrt(np.einsum("it,ij,jt->t", columns, covariance, columns))
            held.append(np.abs(x[members] @ columns - truth) < quantile * std)
    hidden = {entry.name for entry in estimate.dropped}
    expected = estimate.regrouped({name: TRUTH.get(name, 0.0) for name in estimate.parameters.names})
    ends = [
        (expected[name], estimate.interval(name) or (np.nan, np.nan))
        for name in expected
        if name not in hidden and name.endswith(LINKS)
    ]
    base = [low < value < high for value, (low, high) in ends]
    return np.concatenate(torques), np.concatenate(frictions), np.array(base)


def held(seed: int, folder: Path, log: Log) -> tuple[bool, list[float]]:
    """Whether a term is taken, and shares of torques, friction and base parameters within the intervals of one log."""
    (folder := folder / str(seed)).mkdir()
    robot, path = log.write(folder, seed, friction="auto")
    found = identify_robot_dynamics(robot, [path])
    return bool(found.friction.names[3:]), [own.mean() for own in inside(found, seed, log)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "velocity", "memory"), [(0.4, 0.5, 0.1), (0.7, 0.5, 0.1), (0.7, 1.5, 0.1), (0.7, 0.5, 1.0)]
)
def test_friction_that_is_taken_in_some_logs_only(
    size: float, velocity: float, memory: float, tmp_path: Path
) -> None:
    log = Log(rate=250.0, torque_noise=0.5, memory=memory, stribeck=size, velocity=velocity)
    taken, shares = zip(*over_seeds(held, range(200, 240), tmp_path, log), strict=True)
    torques, frictions, base = np.mean(shares, axis=0)
    print(
        f"{log}: a term in {np.mean(taken):.2f}; {torques:.3f}, of friction {frictions:.3f}, base {base:.3f}"
    )
    assert any(taken)
    assert min(torques, frictions, base) >= 0.9
