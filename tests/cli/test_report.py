"""`flexcal report`, and the reports that `calibrate --out` and `verify --out` leave."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from refusals import assert_refusal
from test_bad_input import refused_run


@pytest.fixture
def calibrated(run, ur5_folder: Path) -> Path:
    """The folder of a rigid calibration of the UR5 on 20 poses."""
    out = ur5_folder / "out"
    files = (ur5_folder / "robot.yaml", ur5_folder / "random.csv")
    assert run("calibrate", *files, "--terms", "kinematic", "--out", out).status == 0
    return out


def test_help_says_where_the_report_comes_from(run) -> None:
    for verb in ("calibrate", "verify"):
        words = " ".join(run(verb, "--help").out.split())
        assert "report.html" in words and "without it there is no report" in words


def test_report_of_a_calibration(run, calibrated: Path) -> None:
    whole = (calibrated / "report.html").read_text("utf-8")
    (calibrated / "report.html").unlink()
    page = run("report", calibrated)
    assert page.status == 0 and f"next: open {calibrated / 'report.html'}" in page.out
    again = (calibrated / "report.html").read_text("utf-8")
    for number in ("25 of 45", "elbow_joint.length_x"):
        assert number in again and number in whole
    assert run("report", calibrated, "--json").document == {"report": str(calibrated / "report.html")}


def test_verification_leaves_its_report(run, calibrated: Path) -> None:
    folder, out = calibrated.parent, calibrated.parent / "check"
    header, *rows = (folder / "grid.csv").read_text().splitlines()
    (folder / "fresh.csv").write_text("\n".join([header, *rows[::25]]) + "\n")
    arguments = (
        folder / "robot.yaml",
        folder / "fresh.csv",
        "--estimates",
        calibrated,
        "--out",
        out,
        "--json",
    )
    mean = run("verify", *arguments).document["verification"]["measured"]["mean_mm"]
    html = (out / "report.html").read_text("utf-8")
    assert "verification report" in html and "best-fit registered" in html and f"{mean:.3f}" in html
    assert run("report", out).status == 0
    assert f"{mean:.3f}" in (out / "report.html").read_text("utf-8")


def test_folders_without_anything_to_report(run, ur5_folder: Path, tmp_path: Path) -> None:
    assert_refusal(refused_run(run, tmp_path, "report", ur5_folder), "E-REPORT-008", "results.json")
    assert_refusal(refused_run(run, tmp_path, "report", tmp_path / "none"), "E-REPORT-008", "results.json")
    (tmp_path / "measured").mkdir()
    (tmp_path / "measured" / "results.json").write_text('{"kind": "poses", "poses": 3}\n')
    assert_refusal(refused_run(run, tmp_path, "report", tmp_path / "measured"), "E-RUN-080")
    (tmp_path / "measured" / "results.json").write_text('{"kind": "measurement", "schema": 1, "poses": 3}\n')
    assert_refusal(refused_run(run, tmp_path, "report", tmp_path / "measured"), "E-REPORT-009")
    (tmp_path / "measured" / "results.json").write_text("{")
    assert_refusal(refused_run(run, tmp_path, "report", tmp_path / "measured"), "E-FILE-023")


def test_results_that_someone_changed_are_named(run, calibrated: Path) -> None:
    results = calibrated / "results.json"
    document = json.loads(results.read_text())
    document["identifiability"]["selected"]["kept"][0] = "no.parameter"
    results.write_text(json.dumps(document))
    assert_refusal(refused_run(run, calibrated.parent, "report", calibrated), "E-CLI-009", str(results))


def test_two_calibrations_are_compared(run, calibrated: Path, tmp_path: Path) -> None:
    folder = calibrated.parent
    again = ("calibrate", folder / "robot.yaml", folder / "random.csv", "--terms", "kinematic", "--out")
    assert run(*again, folder / "again").status == 0
    page = run("report", calibrated, "--compare", folder / "again")
    assert page.status == 0 and "not significant" in page.out and "random.csv" in page.out
    assert "comparison" in (calibrated / "comparison.html").read_text("utf-8")
    document = run("report", calibrated, "--compare", folder / "again", "--json").document
    assert document["runs"] == ["out", "again"] and document["difference_mm"]["mean"] == 0
    assert document["parameters"]["calibration"]["changed"] == [] and document["shared"] == ["random.csv"]
    assert_refusal(refused_run(run, tmp_path, "report", calibrated, "--compare", calibrated), "E-REPORT-001")
    assert_refusal(
        refused_run(run, tmp_path, "report", calibrated, "--compare", folder / "none"),
        "E-REPORT-005",
        "results.json",
    )
    old = folder / "old"
    old.mkdir()
    (old / "results.json").write_text('{"kind": "verification", "schema": 1, "rms_mm": {}, "provenance": {}}')
    header, *_ = rows = (calibrated / "points.csv").read_text("utf-8").splitlines()
    (old / "points.csv").write_text("\n".join(rows) + "\n", "utf-8")
    assert_refusal(
        refused_run(run, tmp_path, "report", calibrated, "--compare", old), "E-REPORT-010", "robot"
    )
    (old / "points.csv").write_text(f"{header}\n", "utf-8")
    assert_refusal(refused_run(run, tmp_path, "report", old), "E-RUN-081")
    check = (
        "verify",
        folder / "robot.yaml",
        folder / "random.csv",
        "--estimates",
        calibrated,
        "--out",
        folder / "check",
    )
    assert run(*check).status == 0
    assert_refusal(
        refused_run(run, tmp_path, "report", calibrated, "--compare", folder / "check"), "E-REPORT-002"
    )


def test_the_command_is_kept_as_given(run, calibrated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = calibrated.parent
    monkeypatch.chdir(folder)
    arguments = (
        "verify",
        folder / "robot.yaml",
        "random.csv",
        "--estimates",
        "out",
        "--out",
        "a b",
        "--json",
    )
    command = "flexcal verify robot.yaml random.csv --estimates out --out 'a b' --json"
    assert run(*arguments).document["command"] == command
    assert command in (folder / "a b" / "report.html").read_text("utf-8").replace("&#39;", "'")
