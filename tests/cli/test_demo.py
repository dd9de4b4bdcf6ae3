"""How `flexcal demo` hands its arguments on, and what it prints; the run itself is tested as a job."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from flexcal.files.transaction import write_text
from flexcal.report.checks import Trust

QUANTITY = {"estimate": 1.05e5, "std": 2e3, "low": 1.01e5, "high": 1.09e5, "truth": 1e5, "identifiable": True}
UNKNOWN = {"estimate": 7e5, "std": None, "low": None, "high": None, "truth": 1.4e5, "identifiable": False}
ERRORS = {"poses": 150, "mean_mm": 0.034, "p90_mm": 0.048, "max_mm": 0.111}
STAGE_ONE = {
    "stiffness": {"joint_1": {"drive": QUANTITY}, "joint_3": {"bearing_y": UNKNOWN}},
    "damping": {"joint_1": {"drive": QUANTITY}},
}
DOCUMENT = {
    "kind": "demo",
    "schema": 1,
    "stage1": STAGE_ONE,
    "cad_alone": {
        "stage1": STAGE_ONE,
        "calibration": ERRORS,
        "verification": {"elastic": {**ERRORS, "max_mm": 0.198}, "elastic_unambiguous": ERRORS},
    },
    "identifiability": {"parameters": 47, "rank": 29, "dropped": []},
    "calibration": ERRORS,
    "verification": dict.fromkeys(("elastic", "elastic_unambiguous", "rigid", "measured"), ERRORS),
    "seconds": {"total": 101.0},
}


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Puts a stand-in for the two-stage procedure in its place, and lists how it was called."""
    made: list[dict[str, Any]] = []

    def run_two_stage(robot: Path, out: Path, **options: Any) -> SimpleNamespace:
        made.append({"robot": robot, "out": out, **options})
        options["progress"]("frequency", 0.5)
        assert out.is_dir()
        write_text(out / "results.json", json.dumps(DOCUMENT))
        return SimpleNamespace(trust=Trust())

    monkeypatch.setattr("flexcal.jobs.two_stage.run_two_stage", run_two_stage)
    return made


def test_arguments_reach_the_procedure(run, calls: list[dict[str, Any]], tmp_path: Path, root: Path) -> None:
    truth = tmp_path / "truth.yaml"
    outcome = run(
        "demo", "--seed", 7, "--plan", "paper", "--truth", truth, "--out", tmp_path / "out", "--json"
    )
    assert outcome.document == DOCUMENT
    (call,) = calls
    assert (call["seed"], call["plan"], call["truth"], call["out"]) == (7, "paper", truth, tmp_path / "out")
    assert call["robot"].resolve() == root / "examples" / "tx90l" / "robot.yaml"
    assert "frequency" in outcome.err
    assert "Trusted: cannot be judged — because no independent check was made" in outcome.err


def test_text_shows_truth_beside_estimate(run, calls: list[dict[str, Any]], tmp_path: Path) -> None:
    page = run("demo", "--out", tmp_path / "out").out
    assert "+5.0 %" in page and "identifiable" in page and "29 of 47" in page
    assert "0.034" in page and "report.html" in page
    assert "CAD alone" in page and "0.198" in page


def test_examples_in_the_current_folder_come_first(
    run, calls: list[dict[str, Any]], tx90l_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tx90l_folder.parent / "examples").mkdir()
    tx90l_folder.rename(tx90l_folder.parent / "examples" / "tx90l")
    monkeypatch.chdir(tx90l_folder.parent)
    assert run("demo", "--out", "out").status == 0
    assert calls[0]["robot"] == Path("examples/tx90l/robot.yaml")
