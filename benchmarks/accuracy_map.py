"""How long the accuracy map of a million poses of the TX90L takes on all cores, and how far it is from the full derivatives."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from flexcal.calibration.accuracy import predicted_accuracy, random_poses_in
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import (
    covariance_root,
    moving_parameters,
    predict_measurements,
    propagation,
)
from flexcal.data.poses import PoseSet
from flexcal.estimation import distance_quantile, principal_variances
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import RobotModel
from flexcal.model.statics import certain_flank

ROBOT = Path(__file__).parent.parent / "examples" / "tx90l" / "robot.yaml"
POINTS = 1_000_000
WANTED = 10.0
"""s."""
COMPARED = 2000


def run() -> list[tuple[str, float, str]]:
    """Wanted over needed time; largest deviation of the 95 % error from that with all derivatives where the arm rests."""
    rng = np.random.default_rng(0)
    nominal = RobotModel.from_yaml(ROBOT, estimates=False)
    lower, upper = joint_ranges(nominal)
    model = fit_geometry(nominal, _measured(nominal, rng.uniform(lower, upper, (60, nominal.n)), rng)).model
    reach = propagation(model)
    q = random_poses_in(reach, POINTS, rng)
    wall, processor = time.perf_counter(), time.process_time()
    predicted_accuracy(reach, q)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    few = q[:COMPARED]
    names = [n for n in moving_parameters(model) if model.posterior.determines(n)]
    at = predict_measurements(model, _poses(model, few, np.zeros((COMPARED, 3)), 1e-5), jacobians=True)
    roots = at.jacobian(names) @ covariance_root(model, names)
    exact = distance_quantile(principal_variances(roots @ np.swapaxes(roots, 1, 2)))
    sure = certain_flank(model, few, at.rest.torque)[:, list(model.backlash_joints)].all(axis=1)
    away = float(np.abs(predicted_accuracy(reach, few).p95 / exact - 1)[sure].max())
    return [
        (
            f"accuracy map of {POINTS:.0e} poses, {os.cpu_count()} cores, ≤ {WANTED:g} s",
            WANTED / wall,
            f"{wall:.1f} s, {processor:.1f} s of processor time, {1e6 * processor / POINTS:.1f} µs a pose, {len(names)} parameters",
        ),
        (
            "the same, 1 % over its largest deviation from full derivatives",
            1e-2 / away,
            f"{away:.1e} at {int(sure.sum())} poses whose backlash flank is certain",
        ),
    ]


def _measured(model: RobotModel, q: np.ndarray, rng: np.random.Generator) -> PoseSet:
    sigma = 3e-5
    points = predict_measurements(model, _poses(model, q, np.zeros((len(q), 3)), sigma)).position
    return _poses(model, q, points + sigma * rng.standard_normal(points.shape), sigma)


def _poses(model: RobotModel, q: np.ndarray, position: np.ndarray, sigma: float) -> PoseSet:
    size = len(q)
    return PoseSet(
        q=q,
        position=position,
        sigma=np.full((size, 3), sigma),
        torque=None,
        payload=None,
        target=np.full(size, model.point().name),
        station=np.full(size, model.stations.names[0]),
        temperature=None,
        pose=np.arange(size),
    )
