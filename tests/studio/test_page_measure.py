"""The page of the measurement, as a person uses it beside the robot."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Running, studio
from page_elements import WAIT

from flexcal import PosePlan, RobotModel, VirtualCell
from flexcal.data.plans import write_plan
from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.files.formats import read_yaml
from flexcal.jobs.guidance import GuidedSession
from flexcal.virtual_cell import CellConfig

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"
COUNT = 16


@pytest.fixture(scope="module")
def cell() -> tuple[RobotModel, PosePlan, VirtualCell]:
    """The robot of the example, a plan of random poses, and the virtual cell of seed 1."""
    model = RobotModel.from_yaml(TX90L / "robot.yaml", estimates=False)
    checker = CollisionChecker(model)
    q = random_candidates(
        checker, COUNT, np.random.default_rng(5), MeasuringSetup.declared(model, None, None)
    )
    drawn, _ = VirtualCell.drawn(model, read_yaml(TX90L / "cell.yaml", CellConfig), 1)
    return model, PosePlan(q=q[:COUNT]), drawn


@pytest.fixture
def running(tmp_path: Path, cell: tuple[RobotModel, PosePlan, VirtualCell]) -> Iterator[tuple[Running, Path]]:
    """A studio on the example with the plan."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(TX90L / name, folder / name)
    write_plan(folder / "poses.yaml", cell[1])
    with studio(folder) as process:
        yield process, folder


def rows(folder: Path, name: str = "poses.csv") -> list[dict[str, str]]:
    path = folder / name
    return list(csv.DictReader(path.read_text().splitlines())) if path.is_file() else []


def choose(page: Any, label: str, value: str) -> None:
    page.get_by_label(label, exact=True).first.click()
    page.get_by_role("option", name=value).click()


def text_field(page: Any, label: str) -> Any:
    """The field after a label, which viser does not tie to it."""
    return page.get_by_text(label, exact=True).locator("xpath=following::input[1]")


def type_point(page: Any, *values: str) -> None:
    for axis, value in zip("xyz", values, strict=True):
        page.get_by_label(f"{axis} / mm").fill(value)


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name).click()


def begin(page: Any, url: str) -> None:
    page.goto(url)
    page.get_by_role("link", name="3 Measure").click(timeout=WAIT)
    page.get_by_text("Next: pose 1").wait_for(timeout=WAIT)


def test_a_guided_session_in_the_virtual_cell(page: Any, running: Any, cell: Any) -> None:
    """Rows are those of the cell, the judgement and the prediction those of the library; undo, and exclusion with a reason."""
    (process, folder), (model, plan, virtual) = running, cell
    begin(page, process.url)
    card = page.get_by_label("joint positions of the next pose")
    for degrees in np.rad2deg(plan.q[0]):
        assert f"{degrees:.3f}".replace("-", "\N{MINUS SIGN}") in card.inner_text()
    choose(page, "Rows come from", "virtual cell")
    press(page, "Measure the next pose")
    page.get_by_text("Next: pose 2").wait_for(timeout=WAIT)
    page.keyboard.press("n")
    page.get_by_text("Next: pose 3").wait_for(timeout=WAIT)
    press(page, "Measure all that are left")
    page.get_by_text(f"all {COUNT} planned poses are measured").wait_for(timeout=WAIT)
    measured = virtual.measure(plan)
    there = rows(folder)
    assert [[float(row[axis]) for axis in "xyz"] for row in there] == measured.position.tolist()

    session = GuidedSession(model, plan, measured.subset(slice(0, COUNT - 1)))
    judgement, session = session.judged(measured.subset([COUNT - 1]))
    page.get_by_text(judgement.sentence).wait_for(timeout=WAIT)
    page.get_by_text(session.outlook().sentence).wait_for(timeout=WAIT)

    text_field(page, "Reason").fill("the target shook")
    press(page, "Exclude the last row")
    page.get_by_text(f"pose {COUNT} is excluded: the target shook").first.wait_for(timeout=WAIT)
    assert [row["excluded"] for row in rows(folder)][-2:] == ["", "the target shook"]
    page.keyboard.press("u")
    page.get_by_text(f"undone: row {COUNT} used again").wait_for(timeout=WAIT)
    press(page, "Undo")
    page.get_by_text(f"Next: pose {COUNT}").wait_for(timeout=WAIT)
    assert len(rows(folder)) == COUNT - 1


def test_a_file_that_grows(page: Any, running: Any, cell: Any) -> None:
    """Only complete lines are taken; another header is refused in a sentence that names the remedy; a wrong row is seen."""
    (process, folder), (_, plan, virtual) = running, cell
    measured = virtual.measure(plan)
    begin(page, process.url)
    choose(page, "Rows come from", "a file that grows")
    file = folder / "tracker.csv"
    file.write_text("number;X;Y;Z\n")
    press(page, "Follow")
    page.get_by_text("let 'flexcal import' read it once").wait_for(timeout=WAIT)
    lines = [
        ",".join([str(k + 1), *map(repr, measured.q[k].tolist()), *map(repr, measured.position[k].tolist())])
        for k in range(COUNT)
    ]
    x, y, z = measured.position[-1].tolist()
    lines[-1] = ",".join([str(COUNT), *map(repr, measured.q[-1].tolist()), repr(y), repr(x), repr(z)])
    file.write_text("pose,q1,q2,q3,q4,q5,q6,x,y,z\n" + lines[0] + "\n" + lines[1][:-3])
    page.get_by_text("Next: pose 2").wait_for(timeout=WAIT)
    page.wait_for_timeout(500)
    assert len(rows(folder)) == 1
    with file.open("a") as stream:
        stream.write(lines[1][-3:] + "\n" + "\n".join(lines[2:]) + "\n")
    page.get_by_text("x and y are swapped").first.wait_for(timeout=WAIT)
    assert [[float(row[axis]) for axis in "xyz"] for row in rows(folder)][:-1] == measured.position[
        :-1
    ].tolist()
    press(page, "Exclude the last row")
    page.get_by_text("is excluded: pose").first.wait_for(timeout=WAIT)
    assert "x and y are swapped" in rows(folder)[-1]["excluded"]


def test_a_typed_point(page: Any, running: Any, cell: Any) -> None:
    """It is of the next pose, and of the station that is chosen once the instrument was moved."""
    (process, folder), (_, plan, _) = running, cell
    robot_file = folder / "robot.yaml"
    there = "{tracker: {xyz: [2.5, 0, 1], line_of_sight: true}"
    robot_file.write_text(robot_file.read_text().replace(there, f"{there}, moved: {{xyz: [2.4, 0.3, 1]}}"))
    begin(page, process.url)
    press(page, "Take this point")
    page.get_by_text("x / mm is empty: type x / mm, y / mm, z / mm of pose 1 first").wait_for(timeout=WAIT)
    type_point(page, "534.8619", "-572.7086", "901.3214")
    press(page, "Take this point")
    page.get_by_text("Next: pose 2").wait_for(timeout=WAIT)
    (row,) = rows(folder)
    assert np.allclose(
        [float(row[axis]) for axis in "xyz"], [0.5348619, -0.5727086, 0.9013214], rtol=0, atol=1e-12
    )
    assert [float(row[f"q{i}"]) for i in range(1, 7)] == plan.q[0].tolist()
    assert row["station"] == "tracker"

    choose(page, "Station", "moved")
    type_point(page, "612.3456", "0", "901.3214")
    page.get_by_label("z / mm").press("Enter")
    page.get_by_text("Next: pose 3").wait_for(timeout=WAIT)
    assert [row["station"] for row in rows(folder)] == ["tracker", "moved"]
    assert [float(rows(folder)[-1][axis]) for axis in "xyz"] == pytest.approx([0.6123456, 0.0, 0.9013214])


def test_no_number_that_was_not_typed_is_in_a_row(page: Any, running: Any) -> None:
    """Not that of the last row, nor zero; a request that the browser repeats is no other row.

    What is typed stays until it is taken, for the pose that was next when it was begun, or once more is pressed.
    """
    process, folder = running
    begin(page, process.url)
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if "/enter/" in request.url else None)
    type_point(page, "534.8619", "-572.7086", "901.3214")
    press(page, "Take this point")
    page.get_by_text("Next: pose 2").wait_for(timeout=WAIT)
    again = [*sent, f"{process.url}enter/[]", f"{process.url}enter/{{}}"]
    status = "url => fetch(url).then(answer => answer.status)"
    assert [page.evaluate(status, url) for url in again] == [204, 400, 400]
    fields = [page.get_by_label(f"{axis} / mm") for axis in "xyz"]
    page.wait_for_function("document.querySelector('form:not([data-sent])')")
    assert [field.input_value() for field in fields] == [""] * 3
    for typed, told in (
        (("1", "", "3"), "y / mm is empty"),
        (("1", "2", " "), "z / mm is empty"),
        (("1", "2,5", "3"), "'2,5' is not a number"),
        (("nan", "2", "3"), "'nan' is not a number"),
        (("1", "2", "1_0"), "'1_0' is not a number"),
        (("1", "2", "<b>3</b>"), "'<b>3</b>' is not a number"),
    ):
        type_point(page, *typed)
        press(page, "Take this point")
        page.get_by_text(told).wait_for(timeout=WAIT)
        assert [field.input_value() for field in fields] == list(typed)
    assert len(rows(folder)) == 1

    for field in fields:
        field.fill("")
    press(page, "Take this point")
    page.get_by_text("x / mm is empty").wait_for(timeout=WAIT)
    fields[0].fill("534.8619")
    press(page, "Skip the next pose")
    page.get_by_text("Next: pose 3").wait_for(timeout=WAIT)
    type_point(page, "534.8619", "-572.7086", "901.3214")
    press(page, "Take this point")
    page.get_by_text("the next pose has become pose 3 since this point was begun").wait_for(timeout=WAIT)
    assert len(rows(folder)) == 1
    press(page, "Take this point")
    page.get_by_text("Next: pose 4").wait_for(timeout=WAIT)
    assert [row["pose"] for row in rows(folder)] == ["1", "3"]
