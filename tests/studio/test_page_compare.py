"""The page that compares two calibrations, after a crash of an arm that shares nothing with flexcal."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import studio
from dh_arm import DHArm, postures, tracked, write_poses, write_robot
from page_elements import WAIT, go_to, press

from flexcal.cli.main import main

CRASH = 5e-4


def calibrated(folder: Path, name: str, arm: DHArm, rng: np.random.Generator) -> None:
    """Measure an arm with a tracker that stands anywhere, and calibrate it into a folder of the project."""
    q = postures(rng, 45)
    file = write_poses(folder / f"{name}.csv", q, tracked(arm.points(q), rng, 2e-5), 2e-5)
    arguments = ["calibrate", str(folder / "robot.yaml"), str(file), "--out", str(folder / name)]
    assert main(arguments) == 0


def farthest_moved(arm: DHArm) -> float:
    """Largest displacement, mm, of the reflector by the crash over random postures, the best small motion of all of them taken out."""
    q = postures(np.random.default_rng(0), 400)
    before = arm.points(q)
    moved = arm.turned(2, CRASH).points(q) - before
    turned = np.cross(np.eye(3)[None], before[:, None]).swapaxes(1, 2)
    rigid = np.concatenate([np.broadcast_to(np.eye(3), (len(q), 3, 3)), turned], axis=2).reshape(-1, 6)
    left = moved.ravel() - rigid @ np.linalg.lstsq(rigid, moved.ravel(), rcond=None)[0]
    return 1e3 * float(np.linalg.norm(left.reshape(-1, 3), axis=1).max())


def test_the_joint_that_a_crash_moved_is_named_first(page: Any, tmp_path: Path) -> None:
    """A joint zero moved by 0.5 mrad: the page names the joint before all others, with the size of the change."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder, rng, arm = tmp_path / "cell", np.random.default_rng(11), DHArm.made(11)
    folder.mkdir()
    write_robot(folder)
    calibrated(folder, "before", arm, rng)
    calibrated(folder, "calibration", arm.turned(2, CRASH), rng)
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Compare")
        press(page, "Compare")
        page.get_by_text("The tool moved by").first.wait_for(timeout=WAIT)
        told = page.locator("body").inner_text()
    found = re.search(r"changed \(p < 1e-6\): (joint_\d\.\w+) by ([+-][\d.]+) ± [\d.]+ mrad", told)
    assert found is not None, told
    assert found[1] == "joint_2.offset" and float(found[2]) == pytest.approx(1e3 * CRASH, rel=0.15)
    farthest = re.search(r"mm in the mean and ([\d.]+) ± [\d.]+ mm at most", told)
    assert farthest is not None and float(farthest[1]) == pytest.approx(farthest_moved(arm), rel=0.3)
