"""A studio that is killed in each of its steps, and started again on the same folder."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import calibrated_ur5
import pytest
from browser import studio
from page_elements import choose, count_rows, field, fill, go_to, open_step, press, see
from waiting import until

from flexcal.data.plans import read_plan
from flexcal.files.formats import read_yaml_file
from flexcal.files.transaction import left_over
from flexcal.model.robot import RobotModel

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"


def unfold(page: Any, title: str, button: str) -> None:
    """Open a folder of elements where it is closed, as that of a new plan is where a plan is there."""
    see(page, title)
    page.wait_for_timeout(500)
    if not page.get_by_role("button", name=button, exact=True).is_visible():
        row = page.get_by_text(title, exact=True).locator("xpath=ancestor::*[.//input[@type='checkbox']][1]")
        row.locator("input[type=checkbox]").click()


def require_whole(folder: Path) -> None:
    """Every file of the folder can be read; what waits in hidden folders is left out."""
    read = 0
    for path in sorted(folder.rglob("*")):
        if any(part.startswith((".flexcal-", ".keep-")) for part in path.relative_to(folder).parts):
            continue
        if path.suffix == ".yaml":
            assert isinstance(read_yaml_file(path).data, dict), path
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".csv":
            header, *rows = csv.reader(path.read_text().splitlines())
            assert path.read_text().endswith("\n") and all(len(row) == len(header) for row in rows), path
        else:
            continue
        read += 1
    assert read >= 2


@pytest.mark.slow
def test_killed_while_robot_poses_and_rows_are_made(page: Any, tmp_path: Path) -> None:
    """A number that was written stays; a plan is drawn again; rows, an exclusion and the next pose are as before."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(TX90L / name, folder / name)
    robot_file, table = folder / "robot.yaml", folder / "poses.csv"
    before = robot_file.read_text()

    with studio(folder) as running:
        page.goto(running.url)
        fill(page, "x / mm", "111.5")
        press(page, "Write to robot.yaml")
        until(lambda: robot_file.read_text() != before)
        running.kill()
    require_whole(folder)
    written = robot_file.read_text()
    assert written.count("#") == before.count("#")
    assert RobotModel.from_yaml(robot_file).config.points["smr"].xyz == (0.1115, 0.0, 0.15)

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Robot"
        assert field(page, "x / mm").input_value() == "111.5"
        go_to(page, "Plan")
        fill(page, "Number of poses", "12")
        see(page, "--count 12 --out poses.yaml")
        press(page, "Plan poses")
        until(lambda: left_over(folder) or (folder / "poses.yaml").exists())
        running.kill()
    require_whole(folder)

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Plan"
        assert robot_file.read_text() == written
        unfold(page, "New plan", "Plan poses")
        assert field(page, "Number of poses").input_value() == "12"
        press(page, "Plan poses")
        see(page, "done in")
        plan = read_plan(folder / "poses.yaml")
        assert len(plan.q) == 12
        go_to(page, "Measure")
        see(page, "Next: pose 1")
        choose(page, "Rows come from", "virtual cell")
        press(page, "Measure the next pose (N)")
        see(page, "Next: pose 2")
        page.keyboard.press("n")
        see(page, "Next: pose 3")
        fill(page, "Reason", "the door was opened")
        press(page, "Exclude the last row (X)")
        see(page, "pose 2 is excluded: the door was opened")
        press(page, "Measure all that are left")
        until(lambda: count_rows(table) > 3)
        running.kill()
    require_whole(folder)
    text = table.read_text()
    rows = list(csv.DictReader(text.splitlines()))
    assert [int(row["pose"]) for row in rows] == list(range(1, len(rows) + 1))
    assert [row["excluded"] for row in rows] == ["", "the door was opened", *[""] * (len(rows) - 2)]

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Measure"
        complete = "11 of 12 planned poses are measured"  # one is excluded
        following = f"Next: pose {len(rows) + 1}" if len(rows) < 12 else complete
        see(page, following)
        see(page, "the door was opened")
        assert field(page, "Rows come from").input_value() == "virtual cell"
        assert table.read_text() == text
        press(page, "Measure all that are left")
        see(page, complete)
    assert table.read_text().startswith(text)
    require_whole(folder)


@pytest.mark.slow
def test_killed_while_results_are_made(page: Any, tmp_path: Path) -> None:
    """Results are the former or the new ones, whole; the choices are as before; what was interrupted is started again."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = calibrated_ur5.make(tmp_path / "project")
    header, *poses = (calibrated_ur5.EXAMPLE / "grid.csv").read_text().splitlines(keepends=True)
    (folder / "second.csv").write_text("".join([header, *poses[6::26]]))
    results = (folder / "calibration" / "results.json").read_bytes()

    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Calibrate")
        choose(page, "Measured poses", "random.csv")
        see(page, "random.csv is not in it")
        press(page, "Calibrate again: geometry")
        see(page, "Cancel")  # it runs
        running.kill()
    require_whole(folder)

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Calibrate"
        assert field(page, "Measured poses").input_value() == "random.csv"
        see(page, "open the report")
        press(page, "Calibrate again: geometry")
        see(page, "done in")
        assert (folder / "calibration" / "results.json").read_bytes() != results
        go_to(page, "Verify")
        choose(page, "Fresh poses", "second.csv")
        press(page, "Verify on these poses")
        until(lambda: left_over(folder) or (folder / "verification").exists())
        running.kill()
    require_whole(folder)

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Verify"
        assert field(page, "Fresh poses").input_value() == "second.csv"
        page.get_by_role("button", name="Verify on these poses").click()
        see(page, "done in")
        see(page, "errors of the calibrated model have a P90 of")
        go_to(page, "Compare")
        press(page, "Keep a copy of the calibration")
        until(lambda: list(folder.glob("calibration-*")))
        running.kill()
    require_whole(folder)
    (copy,) = folder.glob("calibration-*")
    for path in (folder / "calibration").iterdir():
        assert (copy / path.name).read_bytes() == path.read_bytes()
    half = folder / ".keep-half" / "calibration"
    half.mkdir(parents=True)
    (half / "results.json").write_bytes(results[:100])

    with studio(folder) as running:
        page.goto(running.url)
        assert open_step(page) == "Compare"
        see(page, "Keep a copy of the calibration")
        chosen = [field(page, label).input_value() for label in ("Earlier", "Later")]
        assert sorted(chosen) == ["calibration", copy.name]
        choose(page, "Earlier", chosen[1])
        choose(page, "Later", chosen[0])
        press(page, "Compare")
        see(page, "the same as a page:")
        running.kill()

    with studio(folder) as running:
        page.goto(running.url)
        see(page, "Keep a copy of the calibration")
        assert [field(page, label).input_value() for label in ("Earlier", "Later")] == chosen[::-1]
