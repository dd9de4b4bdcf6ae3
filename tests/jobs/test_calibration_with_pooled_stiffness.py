"""Calibration with the stiffness of other robots of the model, of an arm that was simulated without the library's statics."""

from pathlib import Path

import numpy as np
import pytest
from simulated_fleet import RIGID, Fleet, SimulatedRobot, random_poses, write_poses, write_robot

from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import write_estimates
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.fleet_prior import (
    ModelPrior,
    PooledValues,
    read_model_prior,
    with_stiffness,
    write_model_prior,
)
from flexcal.model.robot import RobotModel

STIFFNESS = np.array([9e4, 6e4, 4e4])
NAMES = tuple(f"joint_{k}.drive.stiffness" for k in (2, 3, 4))


def robot_of(folder: Path) -> Path:
    """The nominal robot, whose robot.yaml guesses springs of three drives."""
    file = write_robot(folder)
    springs = "".join(
        f"  - {{joint: joint_{k}, drive: {{stiffness: 2.0e5, damping: 100.0}}}}\n" for k in (2, 3, 4)
    )
    file.write_text(file.read_text() + f"elastic:\n{springs}")
    return file


def measured(folder: Path, stiffness: np.ndarray, seed: int, count: int = 35) -> Path:
    """Poses of a robot with these springs, and its own geometry."""
    rng = np.random.default_rng(seed)
    own = Fleet.drawn(rng).robot(rng)
    compliance = RIGID.copy()
    compliance[1:4, 0] = 1 / stiffness
    robot = SimulatedRobot(own.errors, own.tool, own.place, compliance)
    q = random_poses(count, rng)
    return write_poses(folder / "poses.csv", q, robot.measured(q, 3e-5, rng))


@pytest.fixture
def prior(tmp_path: Path) -> Path:
    model = RobotModel.from_yaml(robot_of(tmp_path / "any"))
    three = np.ones(3)
    pooled = PooledValues(
        NAMES,
        ("N m/rad",) * 3,
        ("log",) * 3,
        STIFFNESS,
        0.02 * three,
        0.05 * three,
        20 * three,
        "",
        ("a", "b", "c"),
    )
    write_model_prior(tmp_path / "prior.yaml", ModelPrior(None, pooled, None), model, {})
    return tmp_path / "prior.yaml"


def test_springs_that_were_not_identified_are_from_the_others(prior: Path, tmp_path: Path) -> None:
    robot = robot_of(tmp_path / "next")
    true = STIFFNESS * np.exp(0.05 * np.random.default_rng(1).standard_normal(3))
    poses = measured(robot.parent, true, 11)
    found = calibrate_robot(robot, [poses], terms=["kinematic"], prior=prior, out=tmp_path / "out")
    for name, value in zip(NAMES, true, strict=True):
        std = found.estimate.std(name)
        assert std is not None
        assert std < 0.06 * value
        assert abs(found.estimate.values[name] - value) < 3 * std
    document = found.document()
    assert document["pooled_stiffness"]["parameters"] == list(NAMES)
    assert not document["pooled_stiffness"]["conflict"]["contradicted"]
    assert document["fleet"] is None
    said = " ".join(document["remarks"])
    assert "the stiffness of 3 other robots of the model" in said
    assert "was not identified: the nominal one of robot.yaml" not in said


def test_other_springs_are_told(prior: Path, tmp_path: Path) -> None:
    robot = robot_of(tmp_path / "other")
    poses = measured(robot.parent, 0.4 * STIFFNESS, 12)
    found = calibrate_robot(robot, [poses], terms=["kinematic"], prior=prior)
    document = found.document()
    assert document["pooled_stiffness"]["conflict"]["contradicted"]
    assert any("does not fit this robot (p" in remark for remark in document["remarks"])
    assert found.trust.document()["trusted"] is False


def test_a_robots_own_estimate_comes_first(prior: Path, tmp_path: Path) -> None:
    robot = robot_of(tmp_path / "own")
    own = 0.5 * STIFFNESS
    items = Parameters(
        Parameter(n, "N m/rad", float(v), scale="log") for n, v in zip(NAMES[:2], own, strict=False)
    )
    estimate = Estimate(items, 1e-6 * np.eye(2), 2, (), (True, True), 0.0, 0.0, 100, "converged", "", 1)
    write_estimates(robot.parent / "estimates.yaml", "stiffness", estimate)
    model, taken = with_stiffness(
        RobotModel.from_yaml(robot), read_model_prior(prior, RobotModel.from_yaml(robot)).stiffness
    )
    assert taken is not None
    assert taken.names == (NAMES[2],)
    np.testing.assert_allclose([model.value(n) for n in NAMES], [*own[:2], STIFFNESS[2]])
    assert not model.prior.parameters.keys() & set(NAMES[:2])
