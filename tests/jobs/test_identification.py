"""Identification of dynamics by the library: objects in, one object out, the same as from files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planar_arm import GRAVITY, LENGTH, Log, swings, torque
from refusals import refused

from flexcal import IRLS, SDP, RobotModel, identify_dynamics, read_recording
from flexcal.jobs.dynamics import DynamicsIdentification, identify_robot_dynamics


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """robot.yaml and a log of 10 s with torque noise."""
    return Log(duration=10.0, position_noise=1e-5, torque_noise=0.1, memory=0.05).write(
        tmp_path_factory.mktemp("arm"), 3
    )


@pytest.fixture(scope="module")
def found(files: tuple[Path, Path]) -> DynamicsIdentification:
    robot, log = files
    return identify_dynamics(RobotModel.from_yaml(robot), [log], hold_out=0.2)


def test_it_is_what_the_command_line_finds(
    found: DynamicsIdentification, files: tuple[Path, Path], tmp_path: Path
) -> None:
    stored = identify_robot_dynamics(files[0], [files[1]], hold_out=0.2, out=tmp_path / "out")
    assert stored.estimate.values == found.estimate.values
    np.testing.assert_array_equal(stored.estimate.covariance, found.estimate.covariance)
    assert (tmp_path / "out" / "report.html").is_file()


def test_a_recording_in_memory_is_a_log(found: DynamicsIdentification, files: tuple[Path, Path]) -> None:
    model = RobotModel.from_yaml(files[0])
    again = identify_dynamics(model, [read_recording(files[1], model)], hold_out=0.2)
    assert again.estimate.values == pytest.approx(found.estimate.values, rel=1e-6, abs=1e-9)


def test_a_recording_in_memory_goes_by_a_name_in_the_document(files: tuple[Path, Path]) -> None:
    model = RobotModel.from_yaml(files[0])
    log = read_recording(files[1], model)
    middle = len(log) // 2
    parts = [
        replace(log, q=log.q[rows], torque=log.torque[rows])
        for rows in (slice(0, middle), slice(middle, None))
    ]
    dynamics = identify_dynamics(model, parts[:1], validate=parts[1:], friction="classic")
    assert dynamics.document()["hold_out"]["logs"] == ["validation_1.parquet"]


def test_residuals_and_model_are_those_of_the_estimate(found: DynamicsIdentification) -> None:
    (residuals,), (prediction,) = found.residuals, found.predictions
    share = np.linalg.norm(residuals) / np.linalg.norm(prediction.measured)
    percent = found.document()["error_percent"]
    assert (
        min(percent["train"], percent["held_out"])
        < 100 * share
        < 1.5 * max(percent["train"], percent["held_out"])
    )
    values = found.model.values
    shared = [name for name in found.estimate.values if name in values]
    assert shared and all(values[name] == pytest.approx(found.estimate.values[name]) for name in shared)


def test_a_log_with_another_load_is_named(files: tuple[Path, Path]) -> None:
    """A point mass at the end of the lower link, by virtual work; and three logs of the same robot."""
    model, mass = RobotModel.from_yaml(files[0]), 1.5
    rng = np.random.default_rng(11)
    logs = []
    for _ in range(3):
        _, q, dq, ddq = swings(10.0, 500.0, 0.1, rng)
        acted = torque(q, dq, ddq) + 0.1 * rng.normal(size=q.shape)
        logs.append(replace(read_recording(files[1], model), q=q, torque=acted))
    first, both = q[:, 0], q.sum(axis=1)
    # p = L (cos a + cos b, -sin a - sin b) in x and z, its acceleration with gravity, and columns of the Jacobian
    motion = [(first, dq[:, 0], ddq[:, 0]), (both, dq.sum(axis=1), ddq.sum(axis=1))]
    x = sum(-LENGTH * (np.sin(a) * w + np.cos(a) * v**2) for a, v, w in motion)
    z = sum(-LENGTH * (np.cos(a) * w - np.sin(a) * v**2) for a, v, w in motion) + GRAVITY
    outer = (-LENGTH * np.sin(both), -LENGTH * np.cos(both))
    whole = (outer[0] - LENGTH * np.sin(first), outer[1] - LENGTH * np.cos(first))
    added = mass * np.stack([whole[0] * x + whole[1] * z, outer[0] * x + outer[1] * z], axis=1)
    loaded = replace(logs[2], torque=acted + added)
    alike = identify_dynamics(model, logs, friction="classic").document()["notes"]
    assert not any("other logs" in note for note in alike)
    notes = identify_dynamics(model, [*logs[:2], loaded], friction="classic").document()["notes"]
    (said,) = [note for note in notes if "other logs" in note]
    assert "log_3" in said and "was another load" in said


def test_torques_of_another_motion_are_those_of_lagrange(found: DynamicsIdentification) -> None:
    _, q, dq, ddq = swings(5.0, 200.0, 0.2, np.random.default_rng(8))
    true, given = torque(q, dq, ddq), found.torque(q, dq, ddq)
    moving = np.all(np.abs(dq) > 0.02, axis=1)
    assert np.linalg.norm(given[moving] - true[moving]) < 0.01 * np.linalg.norm(true[moving])
    with refused("E-MODEL-010"):
        found.torque(q, dq[:10], ddq)


def test_it_shows_itself(found: DynamicsIdentification, tmp_path: Path) -> None:
    assert "base parameters by wls" in repr(found) and len(repr(found)) < 200
    assert found.trust.sentence in found.summary()
    assert "<pre>" in found._repr_html_()
    page = found.report(tmp_path / "page.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and "Can I trust it?" in page


@pytest.mark.parametrize("estimator", [SDP(), IRLS()])
def test_estimators_are_objects(estimator: SDP | IRLS, files: tuple[Path, Path]) -> None:
    found = identify_dynamics(RobotModel.from_yaml(files[0]), [files[1]], estimator=estimator)
    assert found.estimator == estimator.name and found.document()["error_percent"]["train"] < 20


def test_an_unknown_friction_is_refused(files: tuple[Path, Path]) -> None:
    with refused("E-ROBOT-017"):
        identify_dynamics(RobotModel.from_yaml(files[0]), [files[1]], friction="stiction")
