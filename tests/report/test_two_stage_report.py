"""The two-stage report: one file, complete without scripts, readable by machines and people."""

from __future__ import annotations

import base64
import re
import shutil
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from outline import Outline
from refusals import refused

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import CALIBRATED, PredictionErrors
from flexcal.estimation import Parameter, Parameters
from flexcal.jobs.pages import report_folder
from flexcal.jobs.result_files import quantities
from flexcal.jobs.two_stage import TwoStageRun
from flexcal.model.robot import RobotModel
from flexcal.report.layout import document_millimetres, millimetres, significant, write_page
from flexcal.report.pages import two_stage_page
from flexcal.report.results import TX90L_PAPER, TwoStageStudy

MEBIBYTE = 1e6


@pytest.fixture(scope="module")
def html(report: Path) -> str:
    return report.read_text("utf-8")


@pytest.fixture(scope="module")
def outline(html: str) -> Outline:
    return Outline(html)


def test_is_one_small_file_that_loads_nothing(html: str, outline: Outline) -> None:
    assert len(html.encode()) < 6.5 * MEBIBYTE
    loaded = [
        a
        for tag in ("script", "img", "link", "iframe")
        for a in outline.all(tag)
        if "src" in a or "href" in a
    ]
    assert loaded == []
    assert all(str(a["href"]).startswith("#") for a in outline.all("a"))
    style = html[html.index("<style>") : html.index("</style>")]
    assert not re.search(r"@import|url\(", style)


def test_everything_readable_stands_before_the_first_script(html: str) -> None:
    first = html.index("<script")
    assert html.rindex("</table>") < first
    assert html.rindex("</figcaption>") < first
    assert html.index('id="verdict"') < html.index("<table")


def test_markup_is_balanced_and_ids_are_unique(outline: Outline) -> None:
    assert outline.unbalanced == []
    ids = [a["id"] for _, a in outline.elements if "id" in a]
    assert len(ids) == len(set(ids))
    targets = {str(a["href"])[1:] for a in outline.all("a")}
    labels = {i for _, a in outline.elements for i in str(a.get("aria-labelledby", "")).split()} - {""}
    assert (targets | labels) <= set(ids)


def test_headings_do_not_skip_a_level(outline: Outline) -> None:
    levels = [int(tag[1]) for tag, _ in outline.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_every_figure_and_table_says_what_it_is(outline: Outline) -> None:
    plots = [a for a in outline.all("div") if "plot" in str(a.get("class", "")).split()]
    assert {a["id"] for a in plots} == set(outline.figures())
    assert all(a["role"] == "group" and len(str(a["aria-label"])) > 30 for a in plots)
    assert all(a.get("aria-labelledby") for a in outline.all("table"))
    assert all(a.get("scope") for a in outline.all("th"))
    for number in ("5", "7", "10", "11", "12", "13"):
        assert f"Figure {number}" in outline.words or f"Figures {number}" in outline.words


def test_arrays_are_float32_in_base64(outline: Outline, simulated: TwoStageRun) -> None:
    before, after = outline.figures()["figure-11"]["data"]
    assert after["y"]["dtype"] == "f4"
    drawn = np.frombuffer(base64.b64decode(after["y"]["bdata"]), dtype=np.float32)
    np.testing.assert_allclose(
        drawn, 1e3 * np.linalg.norm(simulated.calibration.residuals, axis=1), rtol=1e-6
    )
    drawn = np.frombuffer(base64.b64decode(before["y"]["bdata"]), dtype=np.float32)
    np.testing.assert_allclose(drawn, 1e3 * np.linalg.norm(simulated.before.own, axis=1), rtol=1e-6)


def as_measured(run: TwoStageRun, model: PredictionErrors) -> ErrorStatistics:
    """What the tracker reads of a model's errors at the fresh poses."""
    seen = run.measured_verification.position + run.measured_verification.errors
    return ErrorStatistics.of(seen - model.position)


def test_first_screen_answers_the_three_questions(html: str, simulated: TwoStageRun) -> None:
    screen = html[html.index('id="verdict"') : html.index('id="stage1"')]
    for statistics in (
        as_measured(simulated, simulated.nominal_verification),
        as_measured(simulated, simulated.own_verification),
        as_measured(simulated, simulated.rigid_verification[0]),
        simulated.measured_verification.all,
    ):
        assert millimetres(statistics.p90) in screen and millimetres(statistics.max) in screen
    assert TX90L_PAPER.elastic is not None and millimetres(TX90L_PAPER.elastic.max) in screen
    for question in ("How accurate was it?", "How accurate is it?", "Can I trust it?"):
        assert question in screen


def test_all_numbers_stand_beside_the_papers(html: str, simulated: TwoStageRun) -> None:
    """The paper, on hardware: 0.10 mm on its calibration poses, 0.23 mm at nine of ten fresh ones, 0.32 at worst, 0.70 rigid."""
    table = html[html.index('id="table-numbers"') :]
    rows = re.findall(r"<tr.*?</tr>", table[: table.index("</table>")], re.DOTALL)
    cells = [re.sub(r"<[^>]*>", " ", row).split() for row in rows]
    expected = (
        (simulated.calibration.errors, "calibration poses, calibrated", ("0.10",)),
        (as_measured(simulated, simulated.rigid_verification[0]), "rigid calibration", ("0.70",)),
        (simulated.measured_verification.all, "elastic calibration", ("0.23", "0.32")),
    )
    for ours, label, published in expected:
        (row,) = [row for row in cells if label in " ".join(row)]
        for number in (ours.mean, ours.p90, ours.max):
            assert millimetres(number) in row, label
        assert all(any(cell.startswith(number) for cell in row) for number in published), label
    counts = html[html.index('id="table-counts"') :]
    assert re.search(r"determined.*?29.*?30", re.sub(r"<[^>]*>", " ", counts), re.DOTALL)


@pytest.mark.parametrize("kind", ["stiffness", "damping"])
def test_table_1_has_every_interval_and_the_papers_value(
    html: str, study: TwoStageStudy, simulated: TwoStageRun, kind: str
) -> None:
    table = html[html.index(f'id="table-{kind}"') :]
    table = table[: table.index("</table>")]
    rows = [re.sub(r"<[^>]*>", " ", row) for row in re.findall(r"<tr.*?</tr>", table, re.DOTALL)][1:]
    factor = 1e-3 if kind == "stiffness" else 1.0
    assert "95 % interval" in table and len(rows) == len(study.springs(kind)) == 9
    for name, row in zip(study.springs(kind), rows, strict=True):
        interval = simulated.stiffness.estimate.interval(name)
        if interval is None:
            assert "not determined" in row
        else:
            assert " to ".join(significant(factor * end) for end in interval) in row
        assert significant(factor * TX90L_PAPER.springs[name]) in row


def test_the_poses_are_drawn_in_space(outline: Outline, study: TwoStageStudy) -> None:
    traces = outline.figures()["figure-10"]["data"]
    assert {trace["type"] for trace in traces} == {"scatter3d", "cone", "mesh3d"}
    assert len(study.points.poses) == 40


def test_what_is_not_determined_is_said_with_a_reason(outline: Outline, study: TwoStageStudy) -> None:
    assert "not determined by these data" in outline.words
    assert "joint_3 bearing y, damping: the responses hardly depend on it in these poses" in outline.words
    for dropped in study.determined.dropped:
        assert dropped.name in outline.words


def test_poses_are_chosen_by_name(outline: Outline, study: TwoStageStudy) -> None:
    figure = outline.figures()["figure-7"]
    poses = {trace["meta"]["pose"] for trace in figure["data"]}
    assert poses == {f"Pose {r.pose + 1}" for r in study.responses}
    assert figure["selected"] == {"pose": "Pose 1"}
    keys = {(a["data-figure"], a["data-key"]) for a in outline.all("select")}
    assert keys == {("figure-7", "pose"), ("figure-10", "arrows")}


def test_the_folder_gives_the_same_bytes_again(report: Path, html: str, tmp_path: Path) -> None:
    again = tmp_path / "moved"
    shutil.copytree(report.parent, again)
    (again / "report.html").unlink()
    assert report_folder(again).read_text("utf-8") == html


def test_a_folder_of_an_older_version_keeps_its_page(report: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    shutil.copytree(report.parent, old)
    (old / "fitted_responses.npz").unlink()
    before = (old / "report.html").read_bytes()
    with refused("E-FILE-003", "fitted_responses.npz", "No such file"):
        report_folder(old)
    assert (old / "report.html").read_bytes() == before


def test_residuals_stand_against_what_might_explain_them(outline: Outline, simulated: TwoStageRun) -> None:
    drawn = outline.figures()
    ys = np.frombuffer(base64.b64decode(drawn["figure-order"]["data"][0]["y"]["bdata"]), dtype=np.float32)
    np.testing.assert_allclose(ys, 1e3 * simulated.calibration.residuals[:, 0], atol=1e-6)
    assert {"figure-joints", "figure-workspace"} <= set(drawn)


def test_provenance_names_every_input_of_both_stages(outline: Outline, study: TwoStageStudy) -> None:
    for estimate in (study.stiffness, study.geometry):
        assert estimate.provenance
        for key, value in estimate.provenance.items():
            assert key in outline.words and value in outline.words
    assert "flexcal demo --seed 1 --out demo" in outline.words


def test_names_from_files_cannot_break_the_page(study: TwoStageStudy, tmp_path: Path) -> None:
    path = tmp_path / "odd.html"
    odd = "</script><script>alert(1)</script>"
    write_page(path, two_stage_page(replace(study, results={**study.results, "command": odd, "note": odd})))
    assert Outline(path.read_text("utf-8")).unbalanced == []
    assert odd not in path.read_text("utf-8")


def test_a_place_that_cannot_be_written_leaves_nothing(study: TwoStageStudy, tmp_path: Path) -> None:
    (tmp_path / "report.html").mkdir()
    with refused("E-FILE-013"):
        write_page(tmp_path / "report.html", two_stage_page(study))
    assert list(tmp_path.iterdir()) == [tmp_path / "report.html"]


def test_the_papers_springs_are_those_of_the_example(tx90l: RobotModel) -> None:
    for name, value in TX90L_PAPER.springs.items():
        assert tx90l.value(name) == pytest.approx(value, rel=1e-12)


def test_stage_zero_stands_beside_cad_alone(study: TwoStageStudy, tmp_path: Path) -> None:
    """Both columns from their own fits; without stage 0 there is no such section."""
    mass, com = (
        Parameter("link_2.mass", "kg", 21.5, prior_std=0.07, prior_mean=20.0, scale="log"),
        "link_2.com_x",
    )
    found = replace(
        study.stiffness,
        parameters=Parameters([mass, Parameter(com, "m", 0.2345, prior_std=0.01, prior_mean=0.23)]),
        covariance=np.diag([1e-4, 1e-8]),
        dropped=(),
        identifiable=(True, True),
    )
    rigid = study.results["verification"]["rigid"]
    verified = {"elastic": rigid, "elastic_unambiguous": rigid, "expected_rms_mm": 0.4321}
    with_stage_zero = {
        "dynamics": {"parameters": quantities(found)},
        "cad_alone": {"stage1": study.results["stage1"], "verification": verified},
    }
    path = tmp_path / "report.html"
    results = {**study.results, **with_stage_zero}
    write_page(
        path,
        two_stage_page(replace(study, results=results, estimates={**study.estimates, "dynamics": found})),
    )
    section = path.read_text("utf-8")
    section = section[section.index('id="table-stage0-gain"') : section.index('id="provenance"')]
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", section))
    both = f"{document_millimetres(rigid['p90_mm'])} {millimetres(study.exact.statistics(CALIBRATED).p90)}"
    assert f"stage 2: P90 at fresh poses / mm {both}" in text
    expected = float(np.sqrt(np.mean(study.verification.parameter_rms**2)))
    assert f"rms / mm 0.432 {millimetres(expected)}" in text
    assert "link_2.com_x mm 230 10.0 234 0.100" in text or "link_2.com_x mm 230 10.0 235 0.100" in text
    write_page(path, two_stage_page(study))
    assert "table-stage0" not in path.read_text("utf-8")
