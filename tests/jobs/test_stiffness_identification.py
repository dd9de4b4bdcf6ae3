"""Identification of stiffness by the library: objects in, one object out, the same as from files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from small_plan import small_plan

from flexcal import (
    CellConfig,
    FrequencyResponse,
    MultisinePlan,
    RobotModel,
    StiffnessIdentification,
    VirtualCell,
    draw_truth,
    frequency_plan,
    frequency_responses,
    identify_stiffness,
)
from flexcal.data.plans import write_plan
from flexcal.jobs.stiffness import identify_robot_stiffness

Experiment = tuple[MultisinePlan, tuple[FrequencyResponse, ...]]


@pytest.fixture(scope="module")
def nominal(examples: Path) -> RobotModel:
    return RobotModel.from_yaml(examples / "tx90l" / "robot.yaml", estimates=False)


@pytest.fixture(scope="module")
def experiment(nominal: RobotModel, examples: Path) -> Experiment:
    """A plan of two poses of 15 lines, and the responses of a virtual robot by it."""
    whole = frequency_plan(nominal, examples / "tx90l" / "frequency_poses.csv", "default", 3)
    plan = small_plan(whole)
    config = CellConfig()
    truth = draw_truth(nominal, config.spread, np.random.default_rng([3, 0]))
    cell = VirtualCell(nominal.with_values(truth), config, 3, controller_model=nominal)
    names = [nominal.joint_names[k] for k in plan.joints]
    return plan, tuple(frequency_responses(plan, cell.record(plan), joint_names=names))


@pytest.fixture(scope="module")
def identified(nominal: RobotModel, experiment: Experiment) -> StiffnessIdentification:
    plan, responses = experiment
    return identify_stiffness(nominal, responses, plan=plan, seed=2)


def test_it_is_what_the_command_line_finds(
    identified: StiffnessIdentification, experiment: Experiment, examples: Path, tmp_path: Path
) -> None:
    plan, responses = experiment
    for name in ("robot.yaml", "tx90l.urdf"):
        (tmp_path / name).write_bytes((examples / "tx90l" / name).read_bytes())
    write_plan(tmp_path / "plan.yaml", plan)
    files = [tmp_path / f"response_pose_{response.pose + 1}.npz" for response in responses]
    for response, file in zip(responses, files, strict=True):
        response.save(file)
    stored = identify_robot_stiffness(tmp_path / "robot.yaml", files, seed=2, out=tmp_path / "out")
    assert stored.estimate.provenance and not identified.estimate.provenance
    identified.write(tmp_path / "objects")
    one, other = (json.loads((tmp_path / name / "results.json").read_text()) for name in ("out", "objects"))
    assert one.pop("estimates") == str(tmp_path / "out" / "estimates.yaml") and other.pop("estimates") is None
    assert one == other
    assert (tmp_path / "objects" / "estimates.yaml").is_file()


def test_the_model_has_the_estimate(identified: StiffnessIdentification, experiment: Experiment) -> None:
    for name in identified.springs:
        assert identified.model.value(name) == pytest.approx(identified.estimate.values[name])
    shapes = [(len(response.frequencies_hz), 3, 3) for response in experiment[1]]
    assert [errors.shape for errors in identified.residuals] == shapes
    assert not identified.missing_poses and identified.reference_known


def test_it_shows_itself(identified: StiffnessIdentification, tmp_path: Path) -> None:
    assert "18 stiffnesses and dampings from 2 poses" in repr(identified) and len(repr(identified)) < 200
    assert identified.trust.sentence in identified.summary()
    assert "joint_3.bearing_y.stiffness" in identified._repr_html_()
    page = identified.report(tmp_path / "page.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and "Springs and dampers" in page
    assert [file.name for file in tmp_path.iterdir()] == ["page.html"]


def test_responses_of_other_joints_are_refused(nominal: RobotModel, experiment: Experiment) -> None:
    unknown = replace(experiment[1][0], joints=("joint_1", "joint_2", "elbow"))
    with refused("E-STIFF-004", "joint_1, joint_2, elbow"):
        identify_stiffness(nominal, [unknown])
