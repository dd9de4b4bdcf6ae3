"""Compensation of a typed target and of a file, and the customer's report, from the page."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import calibrated_ur5
import polars as pl
import pytest
from browser import studio
from page_elements import WAIT, choose, fill, go_to, press, see

from flexcal import ToolTargets, read_poses
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import write_poses
from flexcal.jobs.deployment import compensate
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.studio.steps.verify.corrected_command import CorrectedCommand, TypedTarget

_TYPE_WHILE_BUSY = """([field, text]) => setTimeout(() => {
    const until = performance.now() + 400, set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set
    while (performance.now() < until) {}
    for (let end = 1; end <= text.length; end++) {
        set.call(field, text.slice(0, end))
        field.dispatchEvent(new Event('input', {bubbles: true}))
    }
}, 0)"""
"""A page that looks at the keys of a number, and at the press of a button after it, only when it is no longer busy."""


def test_targets_are_compensated_and_the_customer_gets_a_report(page: Any, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = calibrated_ur5.make(tmp_path / "ur5")
    robot = CalibratedRobot.from_yaml(folder / "robot.yaml", folder / "calibration")
    poses = read_poses(folder / "random.csv", robot.model)
    targets = pl.DataFrame({"pose": poses.pose[:5]} | {f"q{k + 1}": poses.q[:5, k] for k in range(6)})
    targets.write_csv(folder / "targets.csv")
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Verify")
        press(page, "Compensate")

        correct = page.get_by_role("button", name="Correct the command")
        correct.wait_for(timeout=WAIT)
        place = correct.bounding_box()
        field = page.locator("input[inputmode=decimal]").first
        page.evaluate(_TYPE_WHILE_BUSY, [field.element_handle(), "453"])
        page.mouse.click(place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)
        see(page, "With the nominal command")
        chosen = json.loads((folder / ".studio.json").read_text())
        assert chosen["target position"][0] == 453.0

        see(page, "flexcal compensate robot.yaml targets.csv")
        press(page, "Compensate the file")
        see(page, "Commands for 5 of 5 targets")
        page.get_by_role("link", name="open commands.csv").wait_for(timeout=WAIT)
        commands = pl.read_csv(folder / "commands.csv")
        assert commands["pose"].to_list() == poses.pose[:5].tolist()

        # what a tracker sees at these commands when the calibrated robot is the real one
        q = commands.select([f"q{k}" for k in range(1, 7)]).to_numpy()
        corrected = replace(poses.subset(slice(0, 5)), q=q)
        seen = predict_measurements(robot.model, corrected).position
        write_poses(folder / "corrected.csv", replace(corrected, position=seen))
        write_poses(folder / "nominal.csv", poses.subset(slice(0, 5)))

        press(page, "Export")
        fill(page, "Robot no.", "<b>UR5-7</b>")
        see(page, "--robot-serial")
        press(page, "Write the customer's report")
        page.get_by_role("link", name="open calibration/customer.html").wait_for(timeout=WAIT)
        assert "&lt;b&gt;UR5-7&lt;/b&gt;" in (folder / "calibration" / "customer.html").read_text("utf-8")
        choose(page, "Before", "nominal.csv")
        choose(page, "After", "corrected.csv")
        see(page, "--before nominal.csv --after corrected.csv")
        press(page, "Write the certificate")
        page.get_by_role("link", name="open certificate.html").wait_for(timeout=WAIT)
        see(page, "mm after compensation")
        assert "&lt;b&gt;UR5-7&lt;/b&gt;" in (folder / "certificate.html").read_text("utf-8")


def test_targets_and_places_where_the_calibration_does_not_hold_are_marked(page: Any, tmp_path: Path) -> None:
    """Calibrated on the 40 poses of a corner, by the predicted errors of `compensate`; also those of a map."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = calibrated_ur5.make(tmp_path / "ur5", nearest=40)
    robot = CalibratedRobot.from_yaml(folder / "robot.yaml", folder / "calibration")
    poses = read_poses(folder / "random.csv", robot.model)
    targets = ToolTargets(poses.pose, poses.target, q=poses.q)
    far = {str(pose) for pose in poses.pose[compensate(robot, targets).extrapolated > 0]}
    assert 3 < len(far) < 12
    near = read_poses(folder / "grid.csv", robot.model).q[0]
    for q, beyond in ((near, False), (near - 0.8, True)):
        typed = TypedTarget.of_tool(robot.with_points, q, "smr")
        assert CorrectedCommand.of(robot, typed, q).beyond is beyond
    header = {"pose": poses.pose} | {f"q{k + 1}": poses.q[:, k] for k in range(6)}
    pl.DataFrame(header).write_csv(folder / "targets.csv")
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Verify")
        press(page, "Compensate")
        see(page, "flexcal compensate robot.yaml targets.csv")
        press(page, "Compensate the file")
        see(page, f"at {len(far)} of {len(poses)} targets the predicted error is above three times")
        rows = page.locator("table", has_text="pose beyond").locator("tbody tr td:first-child")
        assert set(rows.all_inner_texts()) == far
        press(page, "Map")
        choose(page, "Where", "the poses of random.csv")
        press(page, "Compute the map")
        see(page, "worst places")
        marked = page.locator("table", has_text="worst places").locator("tbody tr", has_text="!")
        assert 0 < marked.count() <= len(far)
