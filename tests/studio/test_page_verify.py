"""The page that verifies, maps, compensates and exports, as a person uses it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import calibrated_ur5
import numpy as np
import polars as pl
import pytest
from browser import studio
from page_elements import WAIT

from flexcal import ToolTargets, read_poses
from flexcal.calibration.measurement import predict_measurements
from flexcal.jobs.deployment import compensate
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.model.statics import tool_at_rest
from flexcal.studio.steps.results import ResultSource


def numbers(pattern: str, text: str) -> list[float]:
    """The numbers of the first place in the text that matches, spaces being whatever separates."""
    found = re.search(pattern, " ".join(text.split()))
    assert found, pattern
    return [float(number) for number in found.groups()]


def test_from_a_calibration_to_the_exported_robot(page: Any, tmp_path: Path) -> None:
    """Numbers on the page are the library's; a file of another program is not overwritten."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = calibrated_ur5.make(tmp_path / "ur5")
    robot = CalibratedRobot.from_yaml(folder / "robot.yaml", folder / "calibration")
    lines = (folder / "random.csv").read_text().splitlines(keepends=True)
    (folder / "half.csv").write_text("".join(lines[: len(lines) // 2]))
    with studio(folder) as running:
        page.goto(running.url)
        page.get_by_role("link", name="5 Verify").click(timeout=WAIT)

        page.get_by_role("button", name="Verify on these poses", exact=True).click(timeout=WAIT)
        page.get_by_text("errors of the calibrated model have a P90 of").first.wait_for(timeout=WAIT)
        page.get_by_role("link", name=re.compile("^pose ")).first.wait_for(timeout=WAIT)
        told = page.locator("body").inner_text()
        poses = read_poses(folder / "random.csv", robot.model)
        off = 1000 * np.linalg.norm(
            poses.position - predict_measurements(robot.model, poses).position, axis=1
        )
        shown = numbers(r"have a P90 of ([\d.]+) mm and a maximum of ([\d.]+) mm", told)
        np.testing.assert_allclose(shown, [np.quantile(off, 0.9), off.max()], atol=0.0006)
        row = numbers(rf"pose {poses.pose[off.argmax()]}\s+([\d.]+)", told)
        assert row == [pytest.approx(off.max(), abs=0.0006)]

        page.get_by_text("verification of random.csv, ").first.wait_for(timeout=WAIT)

        page.get_by_label("Fresh poses", exact=True).first.click(timeout=WAIT)
        page.get_by_role("option", name="half.csv").click(timeout=WAIT)
        page.get_by_text("result below is of random.csv; half.csv has not been verified").wait_for(
            timeout=WAIT
        )
        page.get_by_role("button", name="Verify on these poses", exact=True).click(timeout=WAIT)
        page.get_by_role("button", name="Replace the verification of random.csv").wait_for(timeout=WAIT)
        assert "random.csv" in ResultSource.read(folder / "verification").tables
        page.get_by_role("button", name="Replace the verification of random.csv").click()
        page.get_by_text("verification of half.csv, ").first.wait_for(timeout=WAIT)
        page.get_by_role("button", name="● Verify", exact=True).wait_for(timeout=WAIT)

        page.get_by_role("button", name="Map", exact=True).click()
        page.get_by_label("Where", exact=True).first.click(timeout=WAIT)
        page.get_by_role("option", name="the poses of random.csv").click()
        page.get_by_text("--working=random.csv").wait_for(timeout=WAIT)
        page.get_by_role("button", name="Compute the map").click()
        page.get_by_text("the calibrated tool's mean error is").wait_for(timeout=WAIT)
        page.get_by_text("worst places").wait_for(timeout=WAIT)
        told = page.locator("body").inner_text()
        table = pl.read_csv(folder / "map.csv")
        for label, column in (("before calibration", "uncalibrated_mm"), ("calibrated, mean", "mean_mm")):
            shown = numbers(rf"{label} ([\d.]+) ([\d.]+) ([\d.]+)", told)
            np.testing.assert_allclose(
                shown, np.quantile(table[column].to_numpy(), [0.5, 0.9, 1]), atol=0.0006
            )

        page.get_by_role("button", name="Compensate", exact=True).click()
        page.get_by_role("button", name="Correct the command").click(timeout=WAIT)
        page.get_by_text("With the nominal command").wait_for(timeout=WAIT)
        told = page.locator("body").inner_text()
        shown = [
            numbers(rf"{name} / deg (-?[\d.]+) (-?[\d.]+) ([+-][\d.]+)", told)
            for name in robot.model.motor_names
        ]
        target = ToolTargets(np.array([1]), np.array(["smr"]), position=np.array([[0.4, 0.2, 0.3]]))
        commands = compensate(robot, target).commands
        np.testing.assert_allclose([q for _, q, _ in shown], np.degrees(commands.q[0]), atol=1e-4)
        reached = tool_at_rest(robot.probable, np.radians([[q for _, q, _ in shown]]), None, target.target)
        np.testing.assert_allclose(reached.kinematics.position, target.position, atol=1e-5)

        x = page.locator("input[inputmode=decimal]").first
        x.fill("1400")
        x.press("Tab")
        page.get_by_role("button", name="Correct the command").click()
        page.get_by_text("out of reach: the smallest distance").wait_for(timeout=WAIT)

        page.get_by_role("button", name="Export", exact=True).click()
        (folder / "calibrated.urdf").write_text("another program's")
        page.get_by_role("button", name="Export the robot").click(timeout=WAIT)
        page.get_by_text("was not written by flexcal").first.wait_for(timeout=WAIT)
        assert (folder / "calibrated.urdf").read_text() == "another program's"
        (folder / "calibrated.urdf").unlink()
        page.get_by_role("link", name="open calibrated.urdf").wait_for(state="detached", timeout=WAIT)
        page.get_by_role("button", name="Export the robot").click()
        page.get_by_role("link", name="open calibrated.urdf").wait_for(timeout=WAIT)
        assert ElementTree.parse(folder / "calibrated.urdf").getroot().tag == "robot"


def test_without_a_calibration_the_page_says_what_is_missing(page: Any, studio_url: str) -> None:
    page.goto(studio_url)
    page.get_by_role("link", name="5 Verify").click(timeout=WAIT)
    page.get_by_text("There is no calibration yet").wait_for(timeout=WAIT)
    page.get_by_role("link", name="calibrate first").click()
    page.get_by_text("Measured poses").wait_for(timeout=WAIT)
