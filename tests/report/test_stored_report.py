"""The report of a folder says what its files say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from outline import Outline

from flexcal.report import TwoStageStudy
from flexcal.report.notation import millimetres
from flexcal.report.stored import StoredStudy, stored_page, write_stored_report


@pytest.fixture(scope="module")
def stored(study: TwoStageStudy) -> StoredStudy:
    """What would be left of the simulated study."""
    estimate, truth = study.stiffness.estimate, study.truth or {}
    stage1: dict[str, Any] = {"stiffness": {}, "damping": {}}
    for kind in stage1:
        for name in study.springs(kind):
            joint, spring, _ = name.split(".")
            stage1[kind].setdefault(joint, {})[spring] = estimate.quantity(name, truth.get(name))
    found = study.calibration.identifiability
    fresh = {
        "nominal": study.nominal_verification.all.in_millimetres(),
        "elastic": study.elastic_verification.all.in_millimetres(),
        "rigid": study.rigid_verification[0].all.in_millimetres(),
    }
    results = {
        "stage1": stage1,
        "identifiability": {"parameters": len(found.names), "rank": found.rank, "gap_decades": found.gap},
        "calibration": study.calibration.errors.in_millimetres(),
        "verification": fresh,
        "command": "flexcal demo --seed 9",
        "seed": 9,
    }
    return StoredStudy(
        "folder",
        results,
        {"stiffness": estimate, "calibration": study.calibration.estimate},
        study.responses,
        {"elastic": study.elastic_verification.errors, "rigid": study.rigid_verification[0].errors},
    )


def test_the_numbers_are_those_of_the_whole_report(
    stored: StoredStudy, study: TwoStageStudy, report: Path, tmp_path: Path
) -> None:
    write_stored_report(tmp_path / "report.html", stored)
    outline, whole = (
        Outline((tmp_path / "report.html").read_text("utf-8")),
        Outline(report.read_text("utf-8")),
    )
    assert outline.unbalanced == []
    for statistics in (
        study.nominal_verification.all,
        study.elastic_verification.all,
        study.calibration.errors,
    ):
        assert millimetres(statistics.p90) in outline.words
    estimate = study.stiffness.estimate
    assert f"{estimate.values['joint_1.drive.stiffness'] / 1e3:.1f}" in outline.words
    assert outline.figures()["figure-5"] == whole.figures()["figure-5"]
    elastic = next(c for c in outline.figures()["figure-distribution"]["data"] if "elastic" in c["name"])
    full = next(c for c in whole.figures()["figure-distribution"]["data"] if "elastic" in c["name"])
    assert elastic["x"] == full["x"]
    assert "29 of 47" in outline.words and "flexcal demo --seed 9" in outline.words


def test_a_bad_fit_is_not_trusted(stored: StoredStudy) -> None:
    assert stored_page(stored).verdict.status in ("good", "care")
    lost = replace(stored.estimates["calibration"], status="stalled", message="no descent")
    page = stored_page(replace(stored, estimates={"calibration": lost}))
    assert page.verdict.status == "bad"


def test_no_trust_without_fresh_poses(stored: StoredStudy) -> None:
    results = {"calibration": {"selected": stored.results["calibration"]}, "terms": ["kinematic"]}
    alone = StoredStudy("x", results, {"calibration": stored.estimates["calibration"]})
    assert stored_page(alone).verdict.status == "care"
    chosen = {"terms": ["kinematic"], "order_mm": 0.01, "workspace_mm": 0.01}
    assert (
        stored_page(replace(alone, results=results | {"term_selection": [chosen]})).verdict.status == "good"
    )


def test_stiffness_alone(stored: StoredStudy) -> None:
    results = {"stage1": stored.results["stage1"]}
    page = stored_page(StoredStudy("x", results, {"stiffness": stored.estimates["stiffness"]}))
    assert [section.id for section in page.sections] == ["stage1", "provenance"]
    assert page.verdict.rungs == () and len(page.verdict.facts) == 1
