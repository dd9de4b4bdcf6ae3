"""The report of `identify stiffness` says what its folder says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from outline import Outline

from flexcal.jobs.two_stage import TwoStageRun
from flexcal.report.layout import write_page
from flexcal.report.pages import StiffnessStudy, stiffness_page
from flexcal.report.results import TwoStageStudy


@pytest.fixture
def stiffness(study: TwoStageStudy) -> StiffnessStudy:
    """Stage 1 of the simulated study alone."""
    results = {
        "robot": "tx90l",
        "stage1": study.results["stage1"],
        "command": "flexcal identify stiffness r p",
    }
    return StiffnessStudy(results, study.stiffness, study.responses)


def test_the_numbers_are_those_of_the_whole_report(
    stiffness: StiffnessStudy, simulated: TwoStageRun, report: Path, tmp_path: Path
) -> None:
    write_page(tmp_path / "report.html", stiffness_page(stiffness))
    outline = Outline((tmp_path / "report.html").read_text("utf-8"))
    whole = Outline(report.read_text("utf-8")).figures()
    assert outline.unbalanced == []
    estimate = simulated.stiffness.estimate
    assert f"{estimate.values['joint_1.drive.stiffness'] / 1e3:.1f}" in outline.words
    for figure in ("figure-5", "figure-7"):
        assert outline.figures()[figure] == whole[figure]
    assert "flexcal identify stiffness r p" in outline.words and 64 * "s" in outline.words


def test_truth_is_not_asked_for(stiffness: StiffnessStudy) -> None:
    page = stiffness_page(stiffness)
    assert [section.id for section in page.sections] == ["stage1", "provenance"]
    assert page.verdict.error_ranges == () and len(page.verdict.facts) == 1


def test_a_bad_fit_is_not_trusted(stiffness: StiffnessStudy) -> None:
    assert stiffness_page(stiffness).verdict.status == "unknown"
    lost = replace(stiffness.estimate, status="stalled", message="no descent")
    assert stiffness_page(replace(stiffness, estimate=lost)).verdict.status == "bad"
