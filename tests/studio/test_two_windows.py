"""Two browsers on one studio, and two studios on one folder."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import studio
from page_elements import WAIT, choose, count_rows, go_to, open_step, press, see
from waiting import PATIENCE

from flexcal import PosePlan
from flexcal.data.plans import write_plan

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"
COUNT = 8


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The example with a plan."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(TX90L / name, folder / name)
    q = np.random.default_rng(4).uniform(-0.6, 0.6, (COUNT, 6)) + np.array([0.0, 0.3, 1.2, 0.0, 0.6, 0.0])
    write_plan(folder / "poses.yaml", PosePlan(q=q))
    return folder


@pytest.mark.slow
def test_two_browsers_show_the_same(browser: Any, page: Any, folder: Path) -> None:
    """Steps, rows and the picked pose follow in the other one, also in one that is loaded again or opened late."""
    other_context = browser.new_context(viewport={"width": 820, "height": 1180})
    other = other_context.new_page()
    try:
        with studio(folder) as running:
            page.goto(running.url)
            other.goto(running.url)
            assert open_step(page) == open_step(other) == "Robot"
            go_to(page, "Measure")
            for one in (page, other):
                see(one, "Next: pose 1")
            assert open_step(other) == "Measure"
            choose(other, "Rows come from", "virtual cell")
            press(page, "Measure the next pose (N)")
            for one in (page, other):
                see(one, "Next: pose 2")
            press(other, "Measure the next pose (N)")
            see(page, "Next: pose 3")
            assert count_rows(folder / "poses.csv") == 2

            page.get_by_role("link", name="pose 1", exact=True).click()
            for one in (page, other):
                one.locator("a[aria-current=true]", has_text="pose 1").wait_for(timeout=WAIT)
            see(other, "Exclude pose 1 (X)")
            other.reload()
            other.locator("a[aria-current=true]", has_text="pose 1").wait_for(timeout=WAIT)
            assert open_step(other) == "Measure"
            press(other, "Measure the next pose (N)")
            see(page, "Next: pose 4")
            see(other, "Next: pose 4")
            go_to(other, "Calibrate")
            page.locator("nav [aria-current=step]", has_text="Calibrate").wait_for(timeout=WAIT)
            assert count_rows(folder / "poses.csv") == 3
    finally:
        other_context.close()


def test_a_second_studio_on_the_folder_is_refused(folder: Path) -> None:
    """Two would each take the lines of a file that grows; the second says so and ends, and can begin when the first was killed."""
    arguments = ("studio", str(folder), "--no-browser", "--port", "0")
    command = [sys.executable, "-m", "flexcal.cli.main", *arguments]
    with studio(folder) as first:
        second = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        assert second.returncode == 2
        assert f"another studio (process {first.process.pid}) has project open" in second.stderr
        first.stop(signal.SIGKILL)
    with studio(folder):
        pass
