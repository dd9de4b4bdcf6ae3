"""One simulated run for all report tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from virtual_study import leave_run, simulate_run

from flexcal.model import RobotModel
from flexcal.report import TwoStageStudy
from flexcal.workflow.report_folder import report_folder, two_stage_study
from flexcal.workflow.two_stage_run import TwoStageRun


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
