"""The page of a corrected program: its first screen, its path, and that names of a program are never markup."""

from __future__ import annotations

import numpy as np
from program_results import HOSTILE, program_results, target

from flexcal.model.robot import RobotModel
from flexcal.report.layout.rendering import page_html
from flexcal.report.pages import ProgramStudy, program_page


def test_first_screen(tx90l: RobotModel) -> None:
    page = program_page(ProgramStudy(tx90l, program_results(), np.zeros(6)))
    assert page.verdict.headline == "2 of 4 targets corrected" and page.verdict.status == "care"
    assert [fact.value for fact in page.verdict.facts] == ["2", "0.500", "0.031"]
    assert "line 10" in page.verdict.facts[1].detail
    whole = program_page(ProgramStudy(tx90l, program_results(left=False), np.zeros(6)))
    assert whole.verdict.status == "good" and [section.id for section in whole.sections][1] == "targets"
    none = program_page(ProgramStudy(tx90l, program_results() | {"targets": []}, None))
    assert none.verdict.status == "bad" and not none.figures


def test_path_and_arrows(tx90l: RobotModel) -> None:
    (block,) = program_page(ProgramStudy(tx90l, program_results(), np.zeros(6))).figures
    traces = {trace.name: trace for trace in block.figure.plotly().data if trace.name}
    written = np.stack([traces["as written"][axis] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(written[[0, 2]], [[0.5, 0, 0.3], [0.5, 0.1, 0.3]], atol=1e-6)
    assert np.isnan(written[1]).all(), "the path is cut where a target stays"
    factor = traces["shift"].meta["exaggeration"]
    ends = np.stack([traces["shift"][axis] for axis in "xyz"], axis=1).reshape(2, 3, 3)
    np.testing.assert_allclose((ends[0, 1] - ends[0, 0]) / factor, [3e-4, 0, 4e-4], atol=1e-7)
    assert block.slider is not None and set(block.slider.start) == {traces["shift"].meta["arrows"], "none"}


def test_every_target_is_in_the_table_with_its_reason(tx90l: RobotModel) -> None:
    page = program_page(ProgramStudy(tx90l, program_results(), np.zeros(6)))
    (table,) = [block for section in page.sections if section.id == "targets" for block in section.blocks]
    assert [row[0] for row in table.rows] == ["10", "11", "12", "30"]
    assert table.rows[0][3:7] == ("1, 2, 3, 0, 90, 0", "1.25, 2, 3, 0, 90.001, 0", "0.500", "0.031")
    assert table.rows[1][7] == f"{HOSTILE} is out of reach"
    many = program_results() | {"targets": [target(k, [0.1, 0, 0], [1e-6 * k, 0, 0]) for k in range(1500)]}
    page = program_page(ProgramStudy(tx90l, many, np.zeros(6)))
    (table,) = [block for section in page.sections if section.id == "targets" for block in section.blocks]
    assert len(table.rows) == 1000 and sum(row[7] != "" for row in table.rows) == 2


def test_names_are_never_markup(tx90l: RobotModel) -> None:
    html = page_html(program_page(ProgramStudy(tx90l, program_results(), np.zeros(6))))
    assert "<script>alert" not in html and "<b>&amp;" not in html.replace("&lt;b&gt;&amp;amp;", "")
    assert html.count("&lt;script&gt;alert(&#39;P&#39;)&lt;/script&gt;") >= 4
