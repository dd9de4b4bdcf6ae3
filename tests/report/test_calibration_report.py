"""Reports of calibrating and verifying a measured robot."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from outline import Outline
from refusals import refused
from scipy.spatial.transform import Rotation

from flexcal.calibration.term_selection import TermComparison, considered_document
from flexcal.calibration.verification import CALIBRATED
from flexcal.jobs.accuracy import verify_robot
from flexcal.jobs.calibration import Calibration, calibrate_robot
from flexcal.jobs.pages import report_folder
from flexcal.jobs.pages.report import calibration_study
from flexcal.jobs.result_files import read_arm, read_points
from flexcal.report.layout import millimetres, write_page
from flexcal.report.pages import CalibrationStudy, calibration_page

COMMAND = "flexcal calibrate robot.yaml grid.csv --out fit"


@pytest.fixture(scope="module")
def folder(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The UR5 with 112 of its poses, a temperature that rises and the time of each."""
    folder = tmp_path_factory.mktemp("ur5") / "ur5"
    shutil.copytree(examples / "ur5_tracker", folder)
    header, *rows = (folder / "grid.csv").read_text("utf-8").splitlines()
    warm = [f"{row},{20 + 0.01 * k:.2f},{12.5 * k}" for k, row in enumerate(rows[::9])]
    (folder / "some.csv").write_text("\n".join([f"{header},temperature,t", *warm]) + "\n", "utf-8")
    return folder


@pytest.fixture(scope="module")
def fit(folder: Path) -> Calibration:
    terms = ("kinematic", "gravity_compliance")
    files = folder / "robot.yaml", [folder / "some.csv"]
    return calibrate_robot(*files, terms=terms, out=folder / "fit", command=COMMAND)


@pytest.fixture
def study(fit: Calibration, folder: Path) -> CalibrationStudy:
    final, nan = fit.selected.terms, float("nan")
    rows = [
        TermComparison(None, ("kinematic",), 1.1e-4, 1.2e-4, 1e-4, 3e-4, 0.0, True, ""),
        TermComparison("gravity_compliance", final, 1e-4, 1.05e-4, 9e-5, 3e-4, -50.0, True, "it gains"),
        TermComparison("transmission_1", (*final, "transmission_1"), 1e-4, 1.06e-4, 9e-5, 3e-4, 3.0, False, "it does not gain"),
        TermComparison("backlash", (*final, "backlash"), nan, nan, nan, nan, nan, False, "one flank only"),
    ]  # fmt: skip
    stored = calibration_study(folder / "fit")
    tried = [considered_document(row) for row in rows]
    chosen = {"term_selection": tried, "term_selection_by": "folds"}
    validated = {"by": "folds", "mean_mm": 0.105, "parameters": 27.0, "expected_mm": 0.11}
    return replace(stored, results={**stored.results, **chosen, "cross_validation": validated})


def test_calibration_report_is_complete(study: CalibrationStudy, fit: Calibration, tmp_path: Path) -> None:
    write_page(tmp_path / "report.html", calibration_page(study))
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    assert outline.unbalanced == []
    assert set(outline.figures()) == {
        "figure-10",
        "figure-11",
        "figure-histogram",
        "figure-terms",
        "figure-field",
        "figure-torque",
        "figure-parameters",
        "figure-compliances",
        "figure-order",
        "figure-temperature",
        "figure-time",
        "figure-joints",
        "figure-workspace",
        "figure-rank",
    }
    assert millimetres(fit.selected.errors.p90) in outline.words
    for words in (
        "+ gravity compliance",
        "taken: it gains",
        "left: it does not gain",
        "left: one flank only",
        "Intervals take the terms that cross-validation chose for known",
    ):
        assert words in outline.words
    assert fit.estimate.provenance["input.some.csv"] in outline.words and COMMAND in outline.words
    assert "Are the residuals noise of instrument and robot?" in outline.words
    assert (
        "Uncertainty budget of a measured coordinate" in outline.words and "in the robot's" in outline.words
    )
    assert all(name in outline.words for name in fit.selected.identifiability.kept_names)


def test_the_page_of_the_folder_is_that_of_the_verb(fit: Calibration, folder: Path) -> None:
    page = (folder / "fit" / "report.html").read_bytes()
    report_folder(folder / "fit")
    assert (folder / "fit" / "report.html").read_bytes() == page


def test_stored_points_are_those_of_the_fit(fit: Calibration, folder: Path) -> None:
    points = read_points(folder / "fit", sigma=1e-4)
    np.testing.assert_array_equal(points.calibrated, fit.selected.residuals)
    np.testing.assert_array_equal(points.poses.q, fit.selected.poses.q)
    np.testing.assert_array_equal(points.poses.temperature, fit.selected.poses.temperature)
    np.testing.assert_array_equal(points.poses.time, 12.5 * np.arange(112))
    assert not points.poses.sigma_given and points.poses.target.tolist() == fit.selected.poses.target.tolist()


def test_arrows_are_turned_into_the_frame_of_the_arm(fit: Calibration, folder: Path) -> None:
    """By the rotation that lays the measured points over the arm's tips."""
    arms, measured = read_arm(folder / "fit"), fit.selected.poses.position
    turn, _ = Rotation.align_vectors(arms.tip - arms.tip.mean(axis=0), measured - measured.mean(axis=0))
    np.testing.assert_allclose(
        arms.errors[CALIBRATED],
        turn.apply(fit.selected.residuals),
        atol=1e-6 + 2e-3 * fit.selected.errors.max,
    )
    np.testing.assert_allclose(
        arms.corners[:, -1], arms.tip[np.isin(arms.tip, arms.corners[:, -1]).all(axis=1)]
    )


def test_without_a_selection_fresh_poses_are_asked_for(study: CalibrationStudy) -> None:
    page = calibration_page(
        replace(study, results={**study.results, "term_selection": [], "cross_validation": None})
    )
    assert "figure-terms" not in {block.id for block in page.figures}
    assert "no pose was left out" in page.verdict.checks[0].answer and page.verdict.status == "unknown"


def test_outliers_are_listed(study: CalibrationStudy, tmp_path: Path) -> None:
    flagged = replace(study, estimate=replace(study.estimate, outliers=(3, 7)))
    write_page(tmp_path / "report.html", calibration_page(flagged))
    words = Outline((tmp_path / "report.html").read_text("utf-8")).words
    assert "2 outliers, to which the robust loss gave hardly any weight" in words


def test_nothing_to_see_is_not_blamed_on_a_kept_parameter(study: CalibrationStudy, tmp_path: Path) -> None:
    write_page(tmp_path / "report.html", calibration_page(study))
    words = Outline((tmp_path / "report.html").read_text("utf-8")).words
    assert (
        "e−1"
        not in words[
            words.index("dropped parameters, and what") : words.index("Least determined combinations")
        ]
    )


def test_verification_report_is_complete(fit: Calibration, folder: Path) -> None:
    files = folder / "robot.yaml", [folder / "random.csv"]
    found = verify_robot(*files, estimates=folder / "fit", out=folder / "check")
    page = (folder / "check" / "report.html").read_text("utf-8")
    outline = Outline(page)
    assert outline.unbalanced == []
    assert {"figure-10", "figure-joints", "figure-order"} < set(outline.figures())
    assert "figure-predicted" in outline.figures()
    assert millimetres(found.errors.max) in outline.words
    report_folder(folder / "check")
    assert (folder / "check" / "report.html").read_text("utf-8") == page


def test_three_points_with_sigma_are_predicted_but_not_registered(fit: Calibration, folder: Path) -> None:
    header, *rows = (folder / "random.csv").read_text("utf-8").splitlines()
    few = [f"{header},sigma", *(f"{row},5e-5" for row in rows[:3])]
    (folder / "few.csv").write_text("\n".join(few) + "\n", "utf-8")
    verify_robot(folder / "robot.yaml", [folder / "few.csv"], estimates=folder / "fit", out=folder / "few")
    outline = Outline((folder / "few" / "report.html").read_text("utf-8"))
    assert "figure-predicted" in outline.figures()
    assert "Too few poses to tell" in outline.words


def test_poses_of_the_fit_are_not_called_fresh(fit: Calibration, folder: Path) -> None:
    verify_robot(folder / "robot.yaml", [folder / "some.csv"], estimates=folder / "fit", out=folder / "same")
    words = Outline((folder / "same" / "report.html").read_text("utf-8")).words
    assert (
        "it was fitted to some.csv" in words
        and "measured points outside the fit" not in words
        and "fresh points" not in words
    )


@pytest.mark.parametrize(
    ("name", "spoilt", "absent"),
    [
        ("points.csv", "E-FILE-001", "E-FILE-001"),
        ("arm.npz", "E-FILE-003", "E-FILE-003"),
        ("estimates.yaml", "E-YAML-023", "E-FILE-001"),
        ("results.json", "E-FILE-023", "E-REPORT-008"),
    ],
)
def test_a_spoilt_folder_is_refused_in_one_sentence(
    fit: Calibration, folder: Path, tmp_path: Path, name: str, spoilt: str, absent: str
) -> None:
    shutil.copytree(folder / "fit", tmp_path / "fit")
    (tmp_path / "fit" / name).write_text("pose\n1\n", "utf-8")
    with refused(spoilt, name):
        report_folder(tmp_path / "fit")
    (tmp_path / "fit" / name).unlink()
    with refused(absent, name):
        report_folder(tmp_path / "fit")


def test_results_without_a_number_are_refused(fit: Calibration, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "fit", tmp_path / "fit")
    results = json.loads((tmp_path / "fit" / "results.json").read_text("utf-8"))
    del results["drift"]
    (tmp_path / "fit" / "results.json").write_text(json.dumps(results), "utf-8")
    with refused("E-REPORT-010", "drift"):
        report_folder(tmp_path / "fit")
