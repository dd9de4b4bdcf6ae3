"""Identification of drive gains by the library: objects in, one object out, the same as from files."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import refused
from two_links import GAINS, HELD, PAYLOAD, swings, two_links

from flexcal import GainsIdentification, RobotModel, identify_gains, read_recording
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.jobs.gains import identify_robot_gains

DECLARED = np.array([50.0, 20.0])
ROBOT = (
    "dynamics: {cutoff_hz: 20, decimation: 1, friction: classic}\n"
    "signals: {tau: {columns: [i1, i2], unit: A, gain: [50, 20]}}\n"
)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """robot.yaml, free.csv and loaded.csv, with currents."""
    home = tmp_path_factory.mktemp("arm")
    observation = Observation(two_links(home, ROBOT + PAYLOAD), CLASSIC)
    for name, held in (("free", 0 * HELD), ("loaded", HELD)):
        motion = swings(observation, held, 7)
        columns = {"t": motion.time} | {f"q{i + 1}": motion.q[:, i] for i in range(2)}
        columns |= {f"i{i + 1}": motion.torque[:, i] / DECLARED[i] for i in range(2)}
        columns["payload"] = np.full(len(motion), held[0])
        pl.DataFrame(columns).write_csv(home / f"{name}.csv")
    return home


@pytest.fixture(scope="module")
def nominal(arm: Path) -> RobotModel:
    return RobotModel.from_yaml(arm / "robot.yaml", estimates=False)


@pytest.fixture(scope="module")
def identified(arm: Path, nominal: RobotModel) -> GainsIdentification:
    return identify_gains(nominal, [arm / "free.csv", arm / "loaded.csv"])


def test_it_is_what_the_command_line_finds(
    arm: Path, identified: GainsIdentification, tmp_path: Path
) -> None:
    logs = [arm / "free.csv", arm / "loaded.csv"]
    identify_robot_gains(arm / "robot.yaml", logs, out=tmp_path / "files")
    identified.write(tmp_path / "objects")
    one, other = (json.loads((tmp_path / name / "results.json").read_text()) for name in ("files", "objects"))
    assert {key for key in one if one[key] != other[key]} == {"provenance"} and list(one) == list(other)


def test_gains_of_recordings_in_memory_are_factors(
    arm: Path, nominal: RobotModel, identified: GainsIdentification
) -> None:
    """Read by the declared gains, they are torques already."""
    logs = [read_recording(arm / f"{name}.csv", nominal) for name in ("free", "loaded")]
    again = identify_gains(nominal, logs)
    assert again.gains == pytest.approx(list(np.array(identified.gains) / DECLARED), rel=1e-6)
    assert again.estimate.values == pytest.approx(identified.estimate.values, rel=1e-6)


def test_it_shows_itself(identified: GainsIdentification, tmp_path: Path) -> None:
    assert identified.gains == pytest.approx(list(DECLARED * GAINS), rel=0.01)
    assert "2 of 2 determined" in repr(identified) and len(repr(identified)) < 200
    assert identified.trust.sentence in identified.summary()
    assert "elbow.drive_gain" in identified._repr_html_()
    page = identified.report(tmp_path / "page.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and "How far were the declared gains off?" in page
    assert [file.name for file in tmp_path.iterdir()] == ["page.html"]


def test_a_log_given_twice_is_refused(arm: Path, nominal: RobotModel) -> None:
    with refused("E-RUN-044", "free.csv"):
        identify_gains(nominal, [arm / "free.csv", arm / "free.csv"])
