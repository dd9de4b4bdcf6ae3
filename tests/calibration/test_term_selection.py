"""Cross-validation of terms: folds that do not leak, terms that are there are found, terms that are not stay out."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from flexcal.calibration.error_model import order_folds, workspace_folds
from flexcal.calibration.fit import geometric_parameters
from flexcal.calibration.measurement import predict_measurements
from flexcal.calibration.term_selection import select_terms
from flexcal.data.poses import PoseSet, read_poses
from flexcal.model.robot import RobotModel


def test_folds_in_measuring_order_are_blocks() -> None:
    fold = order_folds(103, 8)
    assert (np.diff(fold) >= 0).all() and set(fold) == set(range(8))
    assert {*np.bincount(fold)} <= {12, 13}


def test_folds_in_the_workspace_are_cells_apart(rng: np.random.Generator) -> None:
    """A long box is cut across into cells of equal count, wherever the instrument stands."""
    points = rng.uniform(0, 1, (400, 3)) * [8.0, 0.4, 0.4]
    fold = workspace_folds(points, 8)
    assert (np.bincount(fold) == 50).all()
    spans = sorted((points[fold == k, 0].min(), points[fold == k, 0].max()) for k in range(8))
    assert all(left[1] < right[0] + 0.2 for left, right in pairwise(spans))
    turned = points @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + 5.0
    again = workspace_folds(turned, 8)
    for k in range(8):
        assert len(set(again[fold == k])) == 1
    assert {*np.bincount(workspace_folds(points[:101], 8))} <= {12, 13}


TERMS = {
    "transmission_2": {
        "shoulder_lift_joint.transmission_2_sin": 1e-4,
        "elbow_joint.transmission_2_cos": -2e-4,
    },
    "gravity_compliance": {
        "shoulder_lift_joint.gravity_compliance": 6e-6,
        "elbow_joint.gravity_compliance": 6e-6,
    },
    "backlash": {"shoulder_lift_joint.backlash": 3e-4, "elbow_joint.backlash": 3e-4},
}


def seen(robot: RobotModel, poses: PoseSet, rng: np.random.Generator) -> PoseSet:
    """What a tracker with a scatter of 0.05 mm sees of `robot`."""
    exact = predict_measurements(robot, poses).position
    return replace(poses, position=exact + 5e-5 * rng.normal(size=exact.shape))


@pytest.fixture
def anywhere(ur5: RobotModel, examples: Path, rng: np.random.Generator) -> PoseSet:
    """400 poses all over the UR5's range; on its small grid the harmonics stand for each other."""
    grid = read_poses(examples / "ur5_tracker" / "grid.csv", ur5).subset(slice(0, 400))
    return replace(grid, q=rng.uniform(-2.5, 2.5, grid.q.shape))


@pytest.mark.parametrize("term", TERMS)
def test_the_term_that_is_there_is_found_alone(
    ur5: RobotModel, anywhere: PoseSet, rng: np.random.Generator, term: str
) -> None:
    joints = ("shoulder_lift_joint", "elbow_joint") if term == "backlash" else ()
    geometry = replace(ur5.config.geometry, backlash=joints)
    robot = replace(ur5, config=replace(ur5.config, geometry=geometry)).with_values(TERMS[term])
    found = select_terms(ur5, seen(robot, anywhere, rng))
    assert found.terms == ("kinematic", term)
    before, after = found.considered[:2]
    assert after.order < before.order and after.workspace < before.workspace
    assert after.taken and after.bic < -20 and not any(row.taken for row in found.considered[2:])
    if term == "backlash":
        assert set(joints) <= set(found.model.config.geometry.backlash)


@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_supports_no_term(ur5: RobotModel, anywhere: PoseSet, seed: int) -> None:
    assert select_terms(ur5, seen(ur5, anywhere, np.random.default_rng(seed))).terms == ("kinematic",)


def test_too_few_poses_are_not_divided(ur5: RobotModel, anywhere: PoseSet) -> None:
    found = select_terms(ur5, anywhere.subset(slice(0, 19)))
    assert found.terms == ("kinematic",) and found.considered == ()
    assert "19 different poses" in found.remark and "measure 1 more" in found.remark


def test_joints_that_gravity_hardly_loads_get_no_compliance(ur5: RobotModel, anywhere: PoseSet) -> None:
    """The pan axis stands upright and the last wrist carries a flange: their compliances would be anything."""
    names = geometric_parameters(ur5, anywhere, ["gravity_compliance"]).names
    assert {"shoulder_lift_joint.gravity_compliance", "elbow_joint.gravity_compliance"} <= set(names)
    assert not {f"{j}.gravity_compliance" for j in ("shoulder_pan_joint", "wrist_3_joint")} & set(names)
    lateral = geometric_parameters(ur5, anywhere, ["lateral_compliance"]).names
    assert {"shoulder_pan_joint.gravity_compliance_1", "shoulder_pan_joint.gravity_compliance_2"} <= set(
        lateral
    )


def test_repeated_poses_count_once(ur5: RobotModel, anywhere: PoseSet) -> None:
    """Thirty visits of ten poses are ten poses, however the encoders jitter."""
    few = anywhere.subset(np.resize(np.arange(10), 30))
    jitter = np.random.default_rng(1).uniform(-1e-3, 1e-3, few.q.shape)
    assert "10 different poses" in select_terms(ur5, replace(few, q=few.q + jitter)).remark


def test_a_robot_without_masses_says_why_compliance_is_not_considered(
    ur5: RobotModel, anywhere: PoseSet
) -> None:
    light = replace(ur5, links=replace(ur5.links, mass=np.zeros(ur5.n)))
    found = select_terms(light, seen(light, anywhere.subset(slice(0, 40)), np.random.default_rng(0)))
    reasons = {row.term: row.reason for row in found.considered}
    for term in ("gravity_compliance", "lateral_compliance", "backlash"):
        assert "gives its links no mass" in reasons[term]
