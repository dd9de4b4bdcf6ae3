"""A frequency experiment and a trajectory, planned from the page."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from browser import studio
from page_elements import WAIT, go_to, press, see

from flexcal.data.plans import FourierPaths, MultisinePlan, TrajectoryPlan, read_plan

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"


def choose(page: Any, label: str, option: str) -> None:
    page.get_by_label(label, exact=True).last.click(timeout=WAIT)
    page.get_by_role("option", name=option).click(timeout=WAIT)


def test_motions_are_planned_and_shown_against_their_limits(page: Any, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "arm"
    shutil.copytree(EXAMPLE, folder)
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Plan")
        choose(page, "What to plan", "Exciting trajectory")
        page.get_by_label("Number of trajectories").last.fill("1", timeout=WAIT)
        see(page, "--count 1")
        page.get_by_label("More", exact=True).last.click()
        for label, value, option in (
            ("Harmonics", "2", "--harmonics 2"),
            ("Searches", "1", "--searches 1"),
            ("Iterations", "2", "--steps 2"),
        ):
            page.get_by_label(label, exact=True).last.fill(value, timeout=WAIT)
            see(page, option)
        press(page, "Plan trajectories")
        see(page, "1 trajectory of 3 periods of 5 s")
        see(page, "All limits of the URDF and of robot.yaml are kept")
        plan = read_plan(folder / "trajectory.yaml")
        assert isinstance(plan, TrajectoryPlan) and isinstance(plan.paths, FourierPaths)
        assert plan.paths.centre.shape == (1, 6)

        choose(page, "What to plan", "Frequency experiment")
        choose(page, "Plan", "default: poses of frequency_poses.csv")
        see(page, "$ flexcal design frequency robot.yaml --out frequency.yaml")
        press(page, "Plan frequency experiment")
        page.get_by_role("button", name="Play").wait_for(timeout=WAIT)
        assert isinstance(read_plan(folder / "frequency.yaml"), MultisinePlan)
