"""The report of an identified payload says what the folder says, and trusts it as far as the numbers go."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from outline import Outline
from refusals import refused

from flexcal.files.formats import read_estimates
from flexcal.jobs.pages import report_folder
from flexcal.jobs.result_files import read_predictions
from flexcal.report.checks import payload_checks
from flexcal.report.layout import to_half_width
from flexcal.report.pages import PayloadStudy
from flexcal.report.pages.payload import payload_page


@pytest.fixture(scope="module")
def outline(payload_folder: Path) -> Outline:
    return Outline((payload_folder / "report.html").read_text("utf-8"))


@pytest.fixture(scope="module")
def study(payload_folder: Path) -> PayloadStudy:
    results = json.loads((payload_folder / "results.json").read_text())
    return PayloadStudy(
        results,
        read_estimates(payload_folder / "estimates.yaml")["payload"],
        read_predictions(payload_folder),
    )


def test_numbers_are_those_of_the_results(
    outline: Outline, study: PayloadStudy, payload_folder: Path
) -> None:
    """Written here in another way: by the decimals that two digits of half the interval have."""
    assert outline.unbalanced == []
    words, results = outline.words, study.results
    for name, factor in (("mass", 1), ("com_x", 1e3), ("com_z", 1e3)):
        item = results["parameters"][f"payload.{name}"]
        decimals = 1 - int(np.floor(np.log10(factor * (item["high"] - item["low"]) / 2)))
        estimate, low, high = (f"{factor * item[key]:.{decimals}f}" for key in ("estimate", "low", "high"))
        assert f"{estimate} {low} to {high}" in words
    assert "not determined, stays as robot.yaml declares it 70" in words and results["declaration"] in words
    assert "1 recording with the payload and 1 without" in words and "robot.yaml: 3 kg" in words
    assert "samples to one row 2 robot.yaml" in words and "flexcal identify payload r l" in words
    for file in ("loaded.csv", "free.csv", "robot.yaml", "two_links.urdf"):
        assert hashlib.sha256((payload_folder.parent / file).read_bytes()).hexdigest() in words


def test_torques_are_those_of_the_logs(outline: Outline, study: PayloadStudy, payload_folder: Path) -> None:
    """Measured ones as the log has them but for its filter, and what is predicted misses as much as the results say."""
    loaded, free = study.predictions
    for log, name in ((loaded, "loaded"), (free, "free")):
        table = pl.read_csv(payload_folder.parent / f"{name}.csv")
        tau = np.array([np.interp(log.time, table["t"], table[f"tau{i}"]) for i in (1, 2)]).T
        assert np.abs(log.measured - tau).max() < 1.0 and not log.held_out.any() and log.stride == 1
    missed = np.concatenate([log.measured - log.predicted for log in (loaded, free)])
    torque = np.concatenate([log.measured for log in (loaded, free)])
    shares = 100 * np.linalg.norm(missed, axis=0) / np.linalg.norm(torque, axis=0)
    error = study.results["error_percent"]
    assert list(error["per_joint"].values()) == pytest.approx(list(shares), rel=0.05)
    assert error["train"] == pytest.approx(100 * np.linalg.norm(missed) / np.linalg.norm(torque), rel=0.05)
    traces = outline.figures()["figure-torques"]["data"]
    assert {trace["meta"]["log"] for trace in traces} == {
        "1: loaded.csv, with payload",
        "2: free.csv, without",
    }


def test_the_folder_gives_the_same_page_again(payload_folder: Path) -> None:
    before = (payload_folder / "report.html").read_bytes()
    assert report_folder(payload_folder).read_bytes() == before


def test_a_folder_without_its_torques_is_refused(payload_folder: Path, tmp_path: Path) -> None:
    for name in ("results.json", "estimates.yaml", "estimates.npz"):
        (tmp_path / name).write_bytes((payload_folder / name).read_bytes())
    with refused("E-FILE-003", "predictions.npz", "the verb that writes it again"):
        report_folder(tmp_path)


def changed(study: PayloadStudy, **changes: Any) -> PayloadStudy:
    return replace(study, results={**study.results, **changes})


def test_the_verdict_turns_with_the_results(study: PayloadStudy) -> None:
    """A page whose every answer is good, and what each number does to it."""
    mass = {"estimate": 4.0, "std": 0.01, "low": 3.98, "high": 4.02, "identifiable": True}
    told = {name: {**item, "identifiable": True} for name, item in study.results["parameters"].items()}
    fine = changed(
        study,
        parameters={**told, "payload.mass": mass},
        declared={"payload.mass": 4.01, **dict.fromkeys(list(told)[1:], 0.0)},
        error_percent={"train": 3.0, "best": 2.0, "per_joint": {"shoulder": 3.0, "elbow": 3.0}},
        body_rise=0.0,
        other_payloads={},
    )

    def statuses(**changes: Any) -> list[str]:
        checks = payload_checks(changed(fine, **changes).results)
        assert payload_page(changed(fine, **changes)).verdict.checks == checks
        return [check.status for check in checks]

    assert statuses() == ["good"] * 6 and payload_page(fine).verdict.status == "good"
    assert statuses(robot_mass_kg=0.5)[2] == "bad" and statuses(robot_mass_kg=0.0)[2] == "good"
    error = fine.results["error_percent"]
    for train, best, status in (
        (6.1, 2.0, "care"),
        (6.1, None, "good"),
        (10.1, 9.0, "care"),
        (30.1, 30.0, "bad"),
    ):
        found = statuses(error_percent={**error, "train": train, "best": best})
        assert found == [status, *["good"] * 5], train
    assert statuses(body_rise=29.0) == ["good"] * 6 and statuses(body_rise=30.0)[1] == "care"
    wide = {**mass, "std": 0.21}
    assert statuses(parameters={**told, "payload.mass": wide})[2] == "care"
    for name, status in (("payload.Ixy", "good"), ("payload.com_y", "care")):
        hidden = {**told, name: {**told[name], "identifiable": False}, "payload.mass": mass}
        assert statuses(parameters=hidden)[3] == status
    for weight, status in ((3.97, "care"), (4.03, "care"), (0.0, "care")):
        declared = {**fine.results["declared"], "payload.mass": weight}
        assert statuses(declared=declared)[4] == status
    assert statuses(declared=None)[4] == "unknown"
    assert statuses(other_payloads={"calibration": 3.0})[5] == "care"


def test_how_far_the_mass_is_off(study: PayloadStudy) -> None:
    answer = payload_checks(study.results)[4].answer
    found = study.results["parameters"]["payload.mass"]["estimate"]
    assert f"{100 * (found / 3.0 - 1):.0f} % above the declared 3 kg" in answer


@pytest.mark.parametrize(
    ("value", "half_width", "text"),
    [
        (3.99451, 0.00305, "3.9945"),
        (400.4, 12.0, "400"),
        (-0.04, 0.36, "−0.04"),
        (-0.001, 0.36, "0.00"),
        (2.0, 0.0, "2.000"),
        (1.0, 0.996, "1.0"),
    ],
)
def test_decimals_go_with_the_interval(value: float, half_width: float, text: str) -> None:
    assert to_half_width(value, half_width) == text
