"""Poses for a robot that will be calibrated with a prior from other robots of its model."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from simulated_fleet import write_robot

from flexcal.calibration.fit import FleetPrior
from flexcal.calibration.measurement import predicted_positions
from flexcal.data.poses import PosePool, PoseSet
from flexcal.design.poses import (
    PoseDesign,
    choose_poses,
    enough_with_prior,
    pose_candidates,
    random_poses,
    tool_error,
)
from flexcal.design.scene import MeasuringSetup, TrackerNoise
from flexcal.model.robot import RobotModel, unit_in

NOISE = 5e-5
FIXED = MeasuringSetup(noise=TrackerNoise(NOISE, 0.0))
OWN = [
    *(f"station.tracker.{key}" for key in ("x", "y", "z", "rx", "ry", "rz")),
    *(f"tool.length_{axis}" for axis in "xyz"),
]


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    return RobotModel.from_yaml(write_robot(tmp_path_factory.mktemp("arm")))


def prior_of(model: RobotModel, share: float, precise: str = "") -> FleetPrior:
    """Robots differ by `share` of 1 mrad and 0.4 mm, in parameters of the joint `precise` by nothing; means are correlated."""
    keys = ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y", "length_z")
    names = [
        f"joint_{k}.{key}"
        for k in range(2, 7)
        for key in keys
        if f"joint_{k}.{key}" in model.geometry_columns
    ]
    sizes = np.array([1e-3 if unit_in(model, name) == "rad" else 4e-4 for name in names])
    spread = share * sizes * np.where([name.startswith(precise + ".") for name in names], 1e-6, 1.0)
    mixed = np.random.default_rng(3).standard_normal((len(names), len(names)))
    uncertainty = np.outer(spread, spread) * (mixed @ mixed.T / len(names) + 0.1 * np.eye(len(names))) / 10
    freedom = np.full(len(names), 30.0)
    return FleetPrior(
        tuple(names), np.zeros(len(names)), uncertainty, spread, freedom, ("kinematic",), ("a", "b", "c")
    )


def designed(model: RobotModel, prior: FleetPrior, count: int) -> PoseDesign:
    rng = np.random.default_rng(8)
    pool, working = random_poses(model, 150, rng, FIXED).q, random_poses(model, 40, rng, FIXED).q
    candidates = pose_candidates(
        model,
        rng=rng,
        candidates=PosePool(pool, np.arange(1, 151)),
        setup=FIXED,
        working=working,
        fleet=prior,
    )
    return choose_poses(candidates, count, rng=rng)


def derivatives(model: RobotModel, q: np.ndarray, names: list[str]) -> np.ndarray:
    """Derivatives (N, 3, p) of the readings by central differences."""
    poses = PoseSet.unmeasured(q, "ball", "tracker")
    columns = []
    for name in names:
        ends = [
            predicted_positions(model.with_values({name: step}), poses, elastic=False)
            for step in (1e-6, -1e-6)
        ]
        columns.append((ends[0] - ends[1]) / 2e-6)
    return np.stack(columns, axis=2)


def test_the_prior_counts_as_pseudo_measurements_of_its_parameters(model: RobotModel) -> None:
    """Predicted error and P90 against least squares of all parameters, in which the prior is further rows; P90 by drawing robots."""
    prior = prior_of(model, 0.05)
    design = designed(model, prior, 12)
    names = [*OWN, *prior.names]
    rows = derivatives(model, design.plan.q, names).reshape(-1, len(names)) / NOISE
    pseudo = np.zeros((len(prior.names), len(names)))
    pseudo[:, len(OWN) :] = np.linalg.inv(np.linalg.cholesky(prior.covariance))
    # the place of instrument and target has no prior here, and a vague one in the design
    inverse = np.linalg.pinv(np.concatenate([rows, pseudo]), rcond=1e-12)
    rng = np.random.default_rng(8)
    random_poses(model, 150, rng, FIXED)
    motions = derivatives(model, random_poses(model, 40, rng, FIXED).q, names)
    moved = motions @ inverse
    assert design.tool_error == pytest.approx(np.sqrt(np.mean(np.sum(moved**2, axis=(1, 2)))), rel=2e-3)
    errors = moved @ np.random.default_rng(9).standard_normal((moved.shape[2], 4000))
    assert design.tool_error_p90 == pytest.approx(np.quantile(np.linalg.norm(errors, axis=1), 0.9), rel=0.02)


def test_no_poses_are_spent_on_what_the_prior_tells(model: RobotModel) -> None:
    """Of two priors, each with another joint that all robots have alike, poses tell less of that joint than those for the other."""
    elbow, wrist = (prior_of(model, 1.0, joint) for joint in ("joint_3", "joint_5"))
    plans = {
        joint: designed(model, prior, 8).plan.q for joint, prior in (("joint_3", elbow), ("joint_5", wrist))
    }
    vague = prior_of(model, 1.0)
    names = [*OWN, *vague.names]
    left = {}
    for joint, q in plans.items():
        rows = derivatives(model, q, names).reshape(-1, len(names)) / NOISE
        information = rows.T @ rows
        information[len(OWN) :, len(OWN) :] += np.linalg.inv(vague.covariance)
        variance = np.diag(np.linalg.pinv(information, rcond=1e-14, hermitian=True)) / np.diag(
            np.pad(vague.covariance, (len(OWN), 0))
        ).clip(1e-30)
        for other in plans:
            left[joint, other] = np.mean([variance[k] for k, n in enumerate(names) if n.startswith(other)])
    for joint, other in (("joint_3", "joint_5"), ("joint_5", "joint_3")):
        assert left[joint, joint] > left[other, joint]


def test_fewer_poses_the_less_robots_differ(model: RobotModel) -> None:
    rng = np.random.default_rng(8)
    pool = PosePool(random_poses(model, 150, rng, FIXED).q, np.arange(1, 151))
    working = random_poses(model, 40, rng, FIXED).q
    numbers = []
    for share in (1e-4, 0.05, 1e3):
        candidates = pose_candidates(
            model, rng=rng, candidates=pool, setup=FIXED, working=working, fleet=prior_of(model, share)
        )
        enough = enough_with_prior(candidates, np.random.default_rng(1))
        numbers.append(enough.poses)
        if share == 0.05:
            chosen = choose_poses(candidates, enough.poses, rng=rng)
            drawn = [
                tool_error(
                    candidates.base,
                    candidates.tool_error_weight,
                    rng.choice(150, enough.poses, replace=False),
                )
                for _ in range(20)
            ]
            assert chosen.tool_error <= enough.error < min(drawn)
    assert 3 <= numbers[0] < numbers[1] < numbers[2] <= 40
    assert numbers[0] <= 12
    with refused("E-DESIGN-026", "2 poses"):
        designed(model, prior_of(model, 0.05), 2)
