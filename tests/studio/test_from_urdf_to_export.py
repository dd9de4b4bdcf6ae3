"""A person's way through the window: from a folder with a URDF and measured poses to the calibrated URDF."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import studio
from page_elements import WAIT

from flexcal import RobotModel, calibrate, read_poses, verify

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the URDF of the UR5, every eighth of its poses, and fresh ones."""
    place = tmp_path / "ur5"
    place.mkdir()
    for name in ("ur5.urdf", "random.csv"):
        shutil.copy(EXAMPLE / name, place)
    lines = (EXAMPLE / "grid.csv").read_text().splitlines()
    (place / "grid.csv").write_text("\n".join([lines[0], *lines[1::8]]) + "\n")
    return place


def open_step(page: Any, title: str) -> None:
    page.get_by_role("link", name=re.compile(rf"^\d {title}$")).click()
    page.locator(f"nav a[aria-current=step]:has-text('{title}')").wait_for(timeout=WAIT)


def number(page: Any, label: str, value: float) -> None:
    """Type a number into the field with this label."""
    row = page.get_by_text(label, exact=True).locator("xpath=ancestor::*[.//input][1]")
    row.locator("input").first.fill(str(value))
    row.locator("input").first.press("Enter")


def test_from_urdf_and_poses_to_the_calibrated_urdf(page: Any, folder: Path) -> None:
    with studio(folder) as running:
        page.goto(running.url)
        page.get_by_role("button", name="Create robot.yaml").click(timeout=WAIT)
        page.get_by_text("A ruler's centimetre suffices", exact=False).wait_for(timeout=WAIT)
        number(page, "z / mm", 31)
        page.get_by_role("button", name="Write to robot.yaml").click(timeout=WAIT)
        page.get_by_text("robot.yaml: measured point smr: (0, 0, 0) → (0, 0, 31) mm.").wait_for(timeout=WAIT)
        assert "0.031" in (folder / "robot.yaml").read_text()

        open_step(page, "Calibrate")
        page.get_by_role("button", name="Calibrate: geometry").click(timeout=WAIT)
        page.get_by_text("Can I trust it?").wait_for(timeout=WAIT)
        shown = page.get_by_text("How accurate is it?").inner_text()
        model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
        expected = calibrate(model, read_poses(folder / "grid.csv", model))
        assert float(re.search(r"\d+\.\d+", shown)[0]) == pytest.approx(expected.errors.p90 * 1e3, abs=6e-4)  # type: ignore[index]

        # the same pose is selected everywhere: in the table, in the figure, and as the robot's pose after a reload
        page.locator("td a").first.click()
        page.locator("td a[aria-current=true]").wait_for(timeout=WAIT)
        page.reload()
        page.locator("td a[aria-current=true]").wait_for(timeout=WAIT)

        open_step(page, "Verify")
        page.get_by_role("button", name="Verify on these poses").click(timeout=WAIT)
        page.get_by_text("Can I trust it?").wait_for(timeout=WAIT)
        results = json.loads((folder / "verification" / "results.json").read_text())
        robot = expected.robot
        by_library = verify(robot, read_poses(folder / "random.csv", model))
        np.testing.assert_allclose(
            results["verification"]["measured"]["p90_mm"], by_library.errors.p90 * 1e3, rtol=1e-4
        )
        page.get_by_role("button", name="Export", exact=True).click(timeout=WAIT)
        page.get_by_role("button", name="Export the robot").click(timeout=WAIT)
        page.get_by_role("link", name=re.compile("calibrated.urdf")).first.wait_for(timeout=WAIT)
    urdf = [path for path in folder.glob("*.urdf") if path.name != "ur5.urdf"]
    assert len(urdf) == 1
    assert "<robot" in urdf[0].read_text()
    assert (folder / "calibration" / "report.html").is_file()
    assert (folder / "verification" / "report.html").is_file()
