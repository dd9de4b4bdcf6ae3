"""Identification of inertials by the library: objects in, one object out, the same as from files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal import (
    InertialsIdentification,
    Recording,
    RobotModel,
    TrajectoryPlan,
    exciting_plan,
    identify_inertials,
)
from flexcal.data.experiments import FolderCell
from flexcal.data.plans import write_plan
from flexcal.jobs.experiments import measure
from flexcal.jobs.experiments.measurement import VIRTUAL
from flexcal.jobs.inertials import identify_robot_inertials

Experiment = tuple[TrajectoryPlan, list[Recording]]


@pytest.fixture(scope="module")
def folder(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX90L's folder with one trajectory and what the virtual cell recorded by it."""
    home = tmp_path_factory.mktemp("tx90l")
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        (home / name).write_bytes((examples / "tx90l" / name).read_bytes())
    nominal = RobotModel.from_yaml(home / "robot.yaml", estimates=False)
    write_plan(home / "trajectory.yaml", exciting_plan(nominal, count=1, seed=5))
    measure(home / "robot.yaml", home / "trajectory.yaml", VIRTUAL, home / "exciting", seed=5)
    return home


@pytest.fixture(scope="module")
def nominal(folder: Path) -> RobotModel:
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


@pytest.fixture(scope="module")
def experiment(folder: Path, nominal: RobotModel) -> Experiment:
    cell = FolderCell(folder / "exciting", nominal)
    assert isinstance(cell.plan, TrajectoryPlan)
    return cell.plan, list(cell.record())


@pytest.fixture(scope="module")
def identified(nominal: RobotModel, experiment: Experiment) -> InertialsIdentification:
    return identify_inertials(nominal, *experiment)


def test_it_is_what_the_command_line_finds(
    identified: InertialsIdentification, folder: Path, tmp_path: Path
) -> None:
    stored = identify_robot_inertials(folder / "robot.yaml", folder / "exciting", out=tmp_path / "files")
    assert stored.estimate.provenance
    identified.write(tmp_path / "objects")
    one, other = (json.loads((tmp_path / name / "results.json").read_text()) for name in ("files", "objects"))
    assert {key for key in one if one[key] != other[key]} == {"estimates"} and list(one) == list(other)
    np.testing.assert_array_equal(stored.estimate.covariance, identified.estimate.covariance)


def test_model_and_residuals_are_those_of_the_estimate(
    identified: InertialsIdentification, nominal: RobotModel
) -> None:
    assert identified.model.value("link_2.mass") == identified.estimate.values["link_2.mass"]
    assert identified.nominal.value("link_2.mass") == nominal.value("link_2.mass")
    (residual,), (torques,) = identified.residuals, identified.after
    share = np.linalg.norm(residual) / np.linalg.norm(torques.measured)
    assert share == pytest.approx(identified.error, rel=1e-12) and share < 0.1 * identified.nominal_error


def test_it_shows_itself(identified: InertialsIdentification, tmp_path: Path) -> None:
    assert "from 1 trajectory, relative torque error" in repr(identified) and len(repr(identified)) < 200
    assert identified.trust.sentence in identified.summary() and "link_2.mass" in identified._repr_html_()
    page = identified.report(tmp_path / "page.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and "How well were torques predicted?" in page


def test_torques_of_the_other_sign_are_refused(nominal: RobotModel, experiment: Experiment) -> None:
    plan, (recording,) = experiment
    with refused("E-RUN-036"):
        identify_inertials(nominal, plan, [replace(recording, torque=-recording.torque)])
