"""The report of identified dynamics says what the results say."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import polars as pl
import pytest
from outline import Outline

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.files.formats import read_estimates
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.jobs.pages import report_folder
from flexcal.report.checks import dynamics_checks
from flexcal.report.figures import torque_traces
from flexcal.report.layout import significant
from flexcal.report.pages import DynamicsStudy
from flexcal.report.pages.dynamics import dynamics_verdict
from flexcal.report.sections import friction_section, signals_table
from flexcal.report.sections.base_parameters import base_correlation


@pytest.fixture(scope="module")
def folder(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX40 with plain friction, the last 30 % held out."""
    robot = tmp_path_factory.mktemp("tx40") / "tx40"
    shutil.copytree(examples / "tx40", robot)
    text = (robot / "robot.yaml").read_text()
    (robot / "robot.yaml").write_text(text.replace("decimation: 100}", "decimation: 100, friction: classic}"))
    identify_robot_dynamics(
        robot / "robot.yaml", [robot / "exciting.parquet"], hold_out=0.3, out=robot / "out"
    )
    return robot / "out"


@pytest.fixture(scope="module")
def outline(folder: Path) -> Outline:
    return Outline((folder / "report.html").read_text("utf-8"))


@pytest.fixture(scope="module")
def study(folder: Path) -> DynamicsStudy:
    results = json.loads((folder / "results.json").read_text())
    return DynamicsStudy(results, read_estimates(folder / "estimates.yaml")["dynamics"], ())


def with_results(study: DynamicsStudy, **changes: Any) -> DynamicsStudy:
    return replace(study, results={**study.results, **changes})


def test_the_page_is_whole_and_needs_no_network(outline: Outline) -> None:
    assert outline.unbalanced == []
    addresses = [
        a.get("src") or a.get("href") or "" for _, a in outline.elements if "src" in a or "href" in a
    ]
    assert addresses and all(address.startswith("#") for address in addresses)


def test_numbers_are_those_of_the_results(outline: Outline, study: DynamicsStudy, folder: Path) -> None:
    error = study.results["error_percent"]
    for value in (error["held_out"], error["train"], *error["per_joint"].values()):
        assert significant(value, 3) in outline.words
    assert "samples to one row 100 robot.yaml" in outline.words
    assert "the last 30 % of every recording" in outline.words and "61 of 61" in outline.words
    for row in study.results["base_parameters"]:
        assert row["name"] in outline.words and significant(row["std"], 2) in outline.words
    log = folder.parent / "exciting.parquet"
    assert hashlib.sha256(log.read_bytes()).hexdigest() in outline.words


def test_figures_have_traces_for_every_joint(outline: Outline) -> None:
    figures = outline.figures()
    assert set(figures) == {"figure-torques", "figure-spectra", "figure-correlation"}
    count: dict[str, int] = {}
    for trace in figures["figure-torques"]["data"] + figures["figure-spectra"]["data"]:
        count[trace["name"]] = count.get(trace["name"], 0) + 1
    assert count == dict.fromkeys(
        (
            "measured",
            "predicted, in the fit",
            "predicted, outside the fit",
            "measured torque",
            "measured minus predicted",
        ),
        6,
    )


def test_a_sentence_in_the_table_of_signals_wraps() -> None:
    signals = {
        "cutoff_hz": 10.0,
        "decimation": 80,
        "proposed": [],
        "time_stamps": {"log.csv": "divided at 2 gaps " * 9},
    }
    assert set(signals_table(signals).text_columns) == {1, 2}


def test_no_line_is_drawn_across_a_gap() -> None:
    time = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(4.0, 5.0, 0.1)])
    torque = np.column_stack([time, -time])
    none = np.zeros((0, 2))
    log = TorquePrediction("log", 1, time, torque, torque, 4.5, np.zeros(0), none, none)
    figure = torque_traces({"a": "N m", "b": "N m"}, {"log": log})
    measured, fitted, unseen = (cast(Any, figure.plotly().data[k]) for k in (0, 2, 4))
    assert [int(np.isnan(trace.y).sum()) for trace in (measured, fitted, unseen)] == [1, 1, 0]
    at = int(np.flatnonzero(np.isnan(measured.y))[0])
    assert measured.x[at - 1] == pytest.approx(1.9) and measured.x[at + 1] == pytest.approx(4.0)


def test_recordings_are_chosen_by_name(folder: Path, tmp_path: Path) -> None:
    """One of the fit and one that only validates: the second is unseen as a whole, and its hash is told too."""
    fresh = tmp_path / "fresh.parquet"
    pl.read_parquet(folder.parent / "exciting.parquet").head(200_000).write_parquet(fresh)
    log, out = folder.parent / "exciting.parquet", tmp_path / "out"
    identify_robot_dynamics(folder.parent / "robot.yaml", [log], validate=[fresh], out=out)
    page = Outline((out / "report.html").read_text("utf-8"))
    figure = page.figures()["figure-torques"]
    shown = {(t["meta"]["log"], t["name"]) for t in figure["data"] if t["name"].startswith("predicted")}
    assert shown == {
        ("1: exciting.parquet", "predicted, in the fit"),
        ("2: fresh.parquet", "predicted, outside the fit"),
    }
    assert {a["data-key"] for a in page.all("select")} == {"log"}
    assert figure["selected"] == {"log": "1: exciting.parquet"}
    assert "On fresh.parquet" in page.words and "fresh.parquet" in page.words[page.words.index("What made") :]


def test_correlations_are_those_of_the_covariance(study: DynamicsStudy) -> None:
    names, correlation = base_correlation(study.results["base_parameters"], study.estimate)
    assert len(names) == 61
    np.testing.assert_allclose(np.diag(correlation), 1.0)
    i, j = names.index("joint_1.viscous"), names.index("joint_1.coulomb")
    a, b = study.estimate.parameters.index(names[i]), study.estimate.parameters.index(names[j])
    std = [study.estimate.std(names[k]) or 0.0 for k in (i, j)]
    assert correlation[i, j] == pytest.approx(study.estimate.covariance[a, b] / (std[0] * std[1]))


def test_the_verdict_turns_with_the_results(study: DynamicsStudy) -> None:
    error = study.results["error_percent"]

    def statuses(changed: DynamicsStudy) -> list[str]:
        return [check.status for check in dynamics_checks(changed.results)]

    per_joint = dict.fromkeys(error["per_joint"], 3.0)
    fine = with_results(
        study,
        error_percent={"train": 3.0, "held_out": 4.0, "per_joint": per_joint},
        bodiless_links=[],
        remarks=[],
    )
    assert statuses(fine) == ["good"] * 5 and dynamics_verdict(fine).status == "good"
    for unseen, status in ((4.6, "care"), (31.0, "bad")):
        worse = with_results(fine, error_percent={**fine.results["error_percent"], "held_out": unseen})
        assert statuses(worse)[0] == dynamics_verdict(worse).status == status
    blind = with_results(fine, hold_out={"share": 0.0, "logs": []})
    assert (
        statuses(blind)[0] == dynamics_verdict(blind).status == "unknown"
        and "not known" in dynamics_verdict(blind).sentence
    )
    other = with_results(fine, hold_out={"share": 0.0, "logs": ["there/fresh.csv"]})
    assert "fresh.csv" in dynamics_verdict(other).sentence
    off = {**fine.results["error_percent"], "per_joint": {**per_joint, "joint_5": 26.0}}
    assert "joint_5" in dynamics_checks(with_results(fine, error_percent=off).results)[1].answer
    assert statuses(with_results(fine, error_percent=off))[1] == "care"
    assert statuses(with_results(fine, rank=60))[2] == "care"
    assert statuses(with_results(fine, bodiless_links=["link_2"]))[3] == "care"
    assert statuses(with_results(fine, remarks=["a", "b"]))[4] == "care"


def test_the_friction_that_was_taken_is_marked() -> None:
    tried = [
        {"terms": list(terms), "cross_validation_percent": error}
        for terms, error in (((), 5.0), (("b (1)",), 4.0), (("b (2)",), 3.0), (("b (2)", "c"), 2.99))
    ]
    results = {"friction_terms": ["viscous", "b"], "friction_shapes": {"b": "2"}, "friction_tried": tried}
    table = next(block for block in friction_section(results).blocks if block.kind == "table")
    assert table.strong == (2,) and table.rows[2] == ("b (2)", "3.000", "–")


def test_the_folder_gives_the_same_page_again(folder: Path) -> None:
    before = (folder / "report.html").read_bytes()
    assert report_folder(folder).read_bytes() == before
