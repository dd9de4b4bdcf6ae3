"""One simulated study for all report tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from virtual_study import simulate_study

from flexcal.model import RobotModel
from flexcal.report import TwoStageStudy, write_two_stage_report


@pytest.fixture(scope="session")
def study(tx90l: RobotModel) -> TwoStageStudy:
    """A two-stage calibration of a robot simulated by the model itself."""
    return simulate_study(tx90l)


@pytest.fixture(scope="session")
def report(study: TwoStageStudy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its report on disk."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_two_stage_report(path, study)
    return path
