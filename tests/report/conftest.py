"""One simulated run and one identified payload for all report tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from two_links import two_links, write_logs
from virtual_study import leave_run, simulate_run

from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.jobs.pages import report_folder, two_stage_study
from flexcal.jobs.payload import identify_robot_payload
from flexcal.jobs.two_stage import TwoStageRun
from flexcal.model.robot import RobotModel
from flexcal.report.results import TwoStageStudy

ROBOT = "dynamics: {cutoff_hz: 20, decimation: 2, friction: classic}\n"
DECLARED = "payload: {frame: lower, mass: 3.0, com: [0.3, 0.07, 0], mass_std: 0.05}\n"


@pytest.fixture(scope="session")
def simulated(tx90l: RobotModel) -> TwoStageRun:
    """A two-stage calibration of a robot simulated by the model itself."""
    return simulate_run(tx90l)


@pytest.fixture(scope="session")
def report(simulated: TwoStageRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its report, in the folder that it was made from."""
    folder = tmp_path_factory.mktemp("report")
    leave_run(folder, simulated)
    return report_folder(folder)


@pytest.fixture(scope="session")
def study(report: Path) -> TwoStageStudy:
    """What the folder holds."""
    return two_stage_study(report.parent)


@pytest.fixture(scope="session")
def payload_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What two links leave that hold 4 kg in one recording, nothing in another, and 3 kg in robot.yaml."""
    home = tmp_path_factory.mktemp("arm")
    observation = Observation(two_links(home, ROBOT), CLASSIC)
    write_logs(observation, home)
    robot = home / "robot.yaml"
    robot.write_text(robot.read_text() + DECLARED)
    out, command = home / "out", "flexcal identify payload r l"
    identify_robot_payload(robot, [home / "loaded.csv"], free=[home / "free.csv"], out=out, command=command)
    return out
