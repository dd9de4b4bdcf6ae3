"""Reports of calibrating and verifying a measured robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from outline import Outline

from flexcal.calibration import TermSelection, calibrate, predict, register, verify
from flexcal.data import PoseSet, read_poses
from flexcal.model import RobotModel
from flexcal.report import (
    CalibrationStudy,
    VerificationStudy,
    write_calibration_report,
    write_verification_report,
)
from flexcal.report.notation import millimetres


@pytest.fixture(scope="module")
def grid(ur5: RobotModel, examples: Path) -> PoseSet:
    poses = read_poses([examples / "ur5_tracker" / "grid.csv"], ur5)
    return poses.subset(np.arange(0, len(poses), 9))


@pytest.fixture(scope="module")
def calibrated(ur5: RobotModel, grid: PoseSet) -> CalibrationStudy:
    rigid = calibrate(ur5, grid, terms=("kinematic",), elastic=False)
    selected = calibrate(ur5, grid, terms=("kinematic", "gravity_compliance"), elastic=False)
    table = (
        (("kinematic",), 1.1e-4, 1.2e-4),
        (("kinematic", "gravity_compliance"), 1.0e-4, 1.05e-4),
        (("kinematic", "gravity_compliance", "transmission_1"), 1.0e-4, 1.06e-4),
    )
    return CalibrationStudy(
        nominal=ur5,
        before=errors_before(ur5, grid),
        rigid=rigid,
        selected=selected,
        selection=TermSelection(selected.terms, ur5, table),
        provenance={"grid.csv": "sha256 12ab"},
        command="flexcal calibrate robot.yaml grid.csv",
    )


def errors_before(model: RobotModel, poses: PoseSet) -> np.ndarray:
    placed = register(model, poses, predict(model, poses, elastic=False).position)
    return poses.position - predict(placed, poses, elastic=False).position


def test_calibration_report_is_complete(calibrated: CalibrationStudy, tmp_path: Path) -> None:
    write_calibration_report(tmp_path / "report.html", calibrated)
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    assert outline.unbalanced == []
    assert set(outline.figures()) >= {
        "figure-terms",
        "figure-order",
        "figure-joints",
        "figure-workspace",
        "figure-rank",
    }
    assert millimetres(calibrated.selected.errors.p90) in outline.words
    assert "+ gravity compliance" in outline.words and "no, not clear enough" in outline.words
    assert "sha256 12ab" in outline.words
    assert "The files state no measurement noise" in outline.words
    kept = calibrated.selected.identifiability.kept_names
    assert all(name in outline.words for name in kept)


def test_without_a_selection_fresh_poses_are_asked_for(calibrated: CalibrationStudy, tmp_path: Path) -> None:
    write_calibration_report(tmp_path / "report.html", replace(calibrated, selection=None))
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    assert "figure-terms" not in outline.figures()
    assert "nothing was left out" in outline.words


def test_outliers_are_listed(calibrated: CalibrationStudy, tmp_path: Path) -> None:
    fit = calibrated.selected
    flagged = replace(fit, estimate=replace(fit.estimate, outliers=(3, 7)))
    write_calibration_report(tmp_path / "report.html", replace(calibrated, selected=flagged))
    words = Outline((tmp_path / "report.html").read_text("utf-8")).words
    assert "2 outliers that the robust loss set aside" in words


def test_nothing_to_see_is_not_blamed_on_a_kept_parameter(
    calibrated: CalibrationStudy, tmp_path: Path
) -> None:
    write_calibration_report(tmp_path / "report.html", calibrated)
    words = Outline((tmp_path / "report.html").read_text("utf-8")).words
    assert (
        "e−1"
        not in words[words.index("dropped parameters, and what") : words.index("The weakest combinations")]
    )


def test_verification_report_is_complete(
    calibrated: CalibrationStudy, ur5: RobotModel, examples: Path, tmp_path: Path
) -> None:
    poses = read_poses([examples / "ur5_tracker" / "random.csv"], ur5)
    study = VerificationStudy(
        model=calibrated.selected.model,
        poses=poses,
        verification=verify(calibrated.selected.model, poses, elastic=False),
        before=errors_before(ur5, poses),
    )
    write_verification_report(tmp_path / "report.html", study)
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    assert outline.unbalanced == []
    assert "figure-predicted" not in outline.figures()
    assert millimetres(study.verification.all.max) in outline.words
    write_verification_report(
        tmp_path / "report.html", replace(study, before=None, poses=replace(poses, sigma_given=True))
    )
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    assert "figure-predicted" in outline.figures()
    assert "Too few poses to tell" in outline.words
