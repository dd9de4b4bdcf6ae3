"""A file of another program, imported from the page."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from browser import studio
from page_elements import WAIT, choose, count_rows, fill, go_to, press, see

from flexcal import RobotModel
from flexcal.jobs.setup import edit_robot
from flexcal.model.kinematics import point_kinematics

TICK = 2 * np.pi / 4096
"""Of a motor of LeRobot, rad."""
TX90L = Path(__file__).parents[2] / "examples" / "tx90l"
EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"


def project(tmp_path: Path) -> Path:
    """A folder with the example's robot and no measurements."""
    folder = tmp_path / "ur5"
    folder.mkdir()
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(EXAMPLE / name, folder / name)
    return folder


def test_columns_and_units_of_another_program(page: Any, tmp_path: Path) -> None:
    """Looked at first, then the rows of the session; a second import goes beside them and replaces nothing."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = project(tmp_path)
    rows = pl.read_csv(EXAMPLE / "random.csv", comment_prefix="#")
    foreign = {f"A{k} [deg]": np.rad2deg(rows[f"q{k}"]) for k in range(1, 7)}
    foreign |= {f"{axis.upper()} [mm]": 1000 * rows[axis] for axis in "xyz"}
    pl.DataFrame(foreign).write_csv(folder / "tracker export.csv", separator=";")
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Measure")
        see(page, "no rows yet")
        choose(page, "Rows come from", "a file in another format")
        see(page, "flexcal import robot.yaml 'tracker export.csv' --out poses.csv")
        press(page, "Show how it is read")
        see(page, "done in")
        row = page.get_by_role("row").filter(has_text="A1 [deg]")
        assert row.inner_text().split()[:4] == ["q1", "A1", "[deg]", "deg"]
        assert not (folder / "poses.csv").exists()
        fill(page, "Columns", "q1='A1 [deg]")
        see(page, "Columns: No closing quotation")
        fill(page, "Columns", "")
        press(page, "Import")
        page.get_by_role("link", name="pose 20", exact=True).wait_for(timeout=WAIT)
        assert count_rows(folder / "poses.csv") == 20
        taken = pl.read_csv(folder / "poses.csv")
        assert np.allclose(taken.select("q1", "x"), rows.select("q1", "x"), rtol=0, atol=1e-9)
        see(page, "--out 'tracker export-imported.csv'")
        press(page, "Import")
        see(page, "is written beside poses.csv")
        assert count_rows(folder / "tracker export-imported.csv") == 20
        press(page, "Import")
        see(page, "tracker export-imported.csv is there already")
    assert count_rows(folder / "poses.csv") == 20


def test_a_file_in_inches_and_a_point_that_is_elsewhere(page: Any, tmp_path: Path) -> None:
    """The page says how the columns were read and what would fit; then where the point fits better, and writes it when asked to."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "arm"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf"):
        shutil.copy(TX90L / name, folder / name)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    q = np.random.default_rng(4).uniform(-1.5, 1.5, (25, model.n))
    points = point_kinematics(model, q, jacobians=False).position
    edit_robot(folder / "robot.yaml", {("points", "smr", "xyz"): [0.06, 0.03, 0.1]})
    foreign = {f"J{k + 1}": q[:, k] for k in range(model.n)}
    foreign |= {axis: points[:, k] / 0.0254 for k, axis in enumerate("xyz")}
    pl.DataFrame(foreign).write_csv(folder / "inch.csv")
    (folder / ".studio.json").write_text('{"step": "Measure", "row source": "a file in another format"}')
    with studio(folder) as running:
        page.goto(running.url)
        press(page, "Import")
        see(page, "if they are in inches")
        page.get_by_text("what it said").click(timeout=WAIT)
        options = re.search(r"read as --map (.*)", page.locator("body").inner_text())
        assert options and "q1=J1[rad]" in options[1]
        size = 0.0254 if "x=x[m]" in options[1] else 25.4
        fill(page, "Columns", " ".join(f"{a}={size}*{a}[{'m' if size < 1 else 'mm'}]" for a in "xyz"))
        press(page, "Import")
        see(page, "or take this place")
        press(page, "Write this place to robot.yaml")
        see(page, "--write-point")
        see(page, "done in")
    found = RobotModel.from_yaml(folder / "robot.yaml").point()
    assert found.xyz == pytest.approx(model.point().xyz, abs=1e-4)


def test_motors_of_lerobot(page: Any, tmp_path: Path) -> None:
    """Ticks become joint positions by LeRobot's file, motors of other names, signs and zeros; what does not fit is refused at first."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = project(tmp_path)
    rows = pl.read_csv(EXAMPLE / "random.csv", comment_prefix="#")
    q = rows.select([f"q{k}" for k in range(1, 7)]).to_numpy()
    joints = re.findall(r'<joint name="([^"]+)" type="revolute"', (folder / "ur5.urdf").read_text())
    motors, signs = [f"m{k}" for k in range(1, 7)], np.array([1, -1, 1, 1, -1, 1])
    entry = {"drive_mode": 0, "homing_offset": 7, "range_min": 95, "range_max": 4001}
    (folder / "my arm.json").write_text(json.dumps({m: {"id": k, **entry} for k, m in enumerate(motors)}))
    ticks = 2048 + signs * (q - np.deg2rad([0, 90, 0, 0, 0, 0])) / TICK
    foreign = {f"{motor}.pos": ticks[:, k] for k, motor in enumerate(motors)}
    foreign |= {f"{axis}_mm": 1000 * rows[axis] for axis in "xyz"}
    pl.DataFrame(foreign).write_csv(folder / "recorded.csv")
    (folder / ".studio.json").write_text('{"step": "Measure", "row source": "a file in another format"}')
    options = [
        f"{joint}={'-' if s < 0 else ''}{m}" for joint, m, s in zip(joints, motors, signs, strict=True)
    ]
    with studio(folder) as running:
        page.goto(running.url)
        see(page, "flexcal import robot.yaml recorded.csv --out poses.csv")
        page.get_by_label("Motors of LeRobot").click(timeout=WAIT)
        choose(page, "LeRobot's file", "my arm.json")
        fill(page, "Motors", " ".join(options))
        press(page, "Import")
        see(page, "the points do not fit this robot")
        assert not (folder / "poses.csv").exists()
        anyway = page.get_by_label("Even if they do not fit the robot")
        anyway.click(timeout=WAIT)
        see(page, "--readings ticks --unchecked --out poses.csv")
        anyway.click(timeout=WAIT)
        fill(page, "Motors", " ".join([options[0], f"{options[1]}+90", *options[2:]]))
        press(page, "Import")
        page.get_by_role("link", name="pose 20", exact=True).wait_for(timeout=WAIT)
        taken = pl.read_csv(folder / "poses.csv").select([f"q{k}" for k in range(1, 7)]).to_numpy()
        assert np.allclose(taken, q, rtol=0, atol=1e-9)
        page.reload()
        see(page, "--lerobot 'my arm.json' --motors")
