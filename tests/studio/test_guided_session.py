"""A guided session on the virtual cell, from the plan to the verification, in the browser."""

from __future__ import annotations

import re
import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from browser import studio
from page_elements import WAIT, choose, count_rows, fill, go_to, press, see
from waiting import PATIENCE

TX90L = Path(__file__).parents[2] / "examples" / "tx90l"
POSES, FRESH = 20, 20
LEAST, MOST = 0.6, 1.6
"""Verified P90 relative to the predicted one: that of 20 poses scatters by a quarter, and the truth is one draw of what is plausible."""
PREDICTED = re.compile(r"(stop|go on): p90 predicted ([\d.]+) mm")


def text(page: Any) -> str:
    return " ".join(page.locator("body").inner_text().split())


def measure(page: Any, table: Path, count: int) -> None:
    """Measure all poses that are left, until the page says stop."""
    press(page, "Measure all that are left")
    deadline = time.monotonic() + PATIENCE
    while count_rows(table) < count:
        assert time.monotonic() < deadline
        found = PREDICTED.search(text(page))
        if found and found[1] == "stop":
            press(page, "Stop measuring")
            return
        page.wait_for_timeout(100)


def prediction(page: Any) -> float:
    """The predicted P90, mm, once all rows are judged and it no longer changes."""
    last, since, deadline = "", time.monotonic(), time.monotonic() + PATIENCE
    while time.monotonic() - since < 1.5 or not PREDICTED.search(last):
        assert time.monotonic() < deadline
        now = text(page)
        if now != last or "judging" in now:
            last, since = now, time.monotonic()
        page.wait_for_timeout(100)
    found = PREDICTED.search(last)
    assert found
    return float(found[2])


@pytest.mark.slow
def test_from_plan_to_verification(page: Any, tmp_path: Path) -> None:
    """The accuracy at fresh poses is what was predicted while measuring; nothing but the page is used."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(TX90L / name, folder / name)
    with studio(folder) as running:
        page.goto(running.url)
        go_to(page, "Plan")
        fill(page, "Number of poses", f"{POSES}")
        see(page, f"--count {POSES} --out poses.yaml")
        press(page, "Plan poses")
        see(page, "done in")
        choose(page, "What to plan", "Poses to verify on")
        see(page, f"--random --count {FRESH}")
        press(page, "Draw random poses")
        see(page, f"{FRESH} random poses, for a verification")

        go_to(page, "Measure")
        choose(page, "Rows come from", "virtual cell")
        measure(page, folder / "poses.csv", POSES)
        predicted = prediction(page)
        choose(page, "Poses", "to verify on")
        see(page, "of 20 planned poses measured")
        measure(page, folder / "others.csv", FRESH)
        see(page, f"all {FRESH} planned poses are measured")

        go_to(page, "Calibrate")
        choose(page, "Measured poses", "poses.csv")
        press(page, "Calibrate: geometry")
        page.get_by_role("button", name="Calibrate again: geometry").wait_for(timeout=WAIT)

        go_to(page, "Verify")
        choose(page, "Fresh poses", "others.csv")
        press(page, "Verify on these poses")
        see(page, "errors of the calibrated model have a P90 of")
        found = re.search(r"errors of the calibrated model have a P90 of ([\d.]+) mm", text(page))
    assert found
    verified = float(found[1])

    assert LEAST < verified / predicted < MOST
