"""Identification of a payload by the library: objects in, one object out, the same as from files."""

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from two_links import two_links, write_logs

from flexcal import (
    DynamicsIdentification,
    PayloadIdentification,
    RobotModel,
    identify_dynamics,
    identify_payload,
    read_recording,
)
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.jobs.payload import identify_robot_payload

ROBOT = "dynamics: {cutoff_hz: 20, decimation: 2, friction: classic}\n"


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """robot.yaml of two links, free.csv and loaded.csv, with torque noise; the payload is not declared."""
    home = tmp_path_factory.mktemp("arm")
    observation = Observation(two_links(home, ROBOT), CLASSIC)
    write_logs(observation, home)
    return home


@pytest.fixture(scope="module")
def own(arm: Path) -> DynamicsIdentification:
    """The robot's own dynamics."""
    return identify_dynamics(
        RobotModel.from_yaml(arm / "robot.yaml", estimates=False), [arm / "free.csv"], hold_out=0.2
    )


@pytest.fixture(scope="module")
def identified(arm: Path, own: DynamicsIdentification) -> PayloadIdentification:
    nominal = RobotModel.from_yaml(arm / "robot.yaml", estimates=False)
    return identify_payload(nominal, [arm / "loaded.csv"], dynamics=own.estimate, frame="lower")


def documents(folder: Path, *names: str) -> list[dict]:
    return [json.loads((folder / name / "results.json").read_text()) for name in names]


def test_it_is_what_the_command_line_finds(
    arm: Path, identified: PayloadIdentification, tmp_path: Path
) -> None:
    identify_robot_dynamics(arm / "robot.yaml", [arm / "free.csv"], hold_out=0.2, out=tmp_path / "own")
    stored = identify_robot_payload(
        arm / "robot.yaml",
        [arm / "loaded.csv"],
        frame="lower",
        estimates=tmp_path / "own",
        out=tmp_path / "files",
    )
    assert stored.estimate.provenance["input.loaded.csv"]
    identified.write(tmp_path / "objects")
    one, other = documents(tmp_path, "files", "objects")
    assert {key for key in one if one[key] != other[key]} == {"estimates", "provenance"}
    assert list(one) == list(other)


def test_logs_without_payload_stand_for_the_dynamics(arm: Path, tmp_path: Path) -> None:
    loaded, free = [arm / "loaded.csv"], [arm / "free.csv"]
    identify_robot_payload(arm / "robot.yaml", loaded, free=free, frame="lower", out=tmp_path / "files")
    nominal = RobotModel.from_yaml(arm / "robot.yaml", estimates=False)
    identify_payload(nominal, loaded, free=free, frame="lower").write(tmp_path / "objects")
    one, other = documents(tmp_path, "files", "objects")
    assert {key for key in one if one[key] != other[key]} == {"estimates", "provenance"}


def test_a_recording_in_memory_is_a_log(
    arm: Path, own: DynamicsIdentification, identified: PayloadIdentification
) -> None:
    """Of the robot that the identification of its dynamics returned."""
    recording = read_recording(arm / "loaded.csv", own.model)
    again = identify_payload(own.model, [recording], dynamics=own.estimate, frame="lower")
    assert again.estimate.values == pytest.approx(identified.estimate.values, rel=1e-6, abs=1e-9)
    assert again.loaded == (Path("log_1.parquet"),)


def test_the_model_holds_the_payload(identified: PayloadIdentification, own: DynamicsIdentification) -> None:
    payload = identified.model.payload
    assert payload is not None and payload.frame == identified.frame == "lower"
    assert payload.mass == identified.estimate.values["payload.mass"] == pytest.approx(4.0, rel=0.01)
    assert identified.model.posterior.determines("payload.mass")
    assert identified.model.value("upper.mass") == own.model.value("upper.mass")
    (residuals,), (prediction,) = identified.residuals, identified.predictions
    share = np.linalg.norm(residuals) / np.linalg.norm(prediction.measured)
    assert share == pytest.approx(identified.fit.error, rel=0.2)


def test_it_shows_itself(identified: PayloadIdentification, tmp_path: Path) -> None:
    assert " kg at (" in repr(identified) and len(repr(identified)) < 200
    assert identified.trust.sentence in identified.summary() and "payload.com_x" in identified._repr_html_()
    page = identified.report(tmp_path / "page.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and "How heavy is it?" in page


def test_what_cannot_be_told_apart_is_refused(arm: Path, own: DynamicsIdentification) -> None:
    nominal = RobotModel.from_yaml(arm / "robot.yaml", estimates=False)
    with refused("E-RUN-094"):
        identify_payload(nominal, [arm / "loaded.csv"])
    with refused("E-RUN-044", "free.csv"):
        identify_payload(nominal, [arm / "free.csv"], dynamics=own.estimate, free=[arm / "free.csv"])
