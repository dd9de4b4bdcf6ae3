"""Size and first paint of the pages that customers get, for the UR5 of the examples (limits: 6.5 MB and 1.5 s in headless Chromium)."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks._chromium import Tab, chromium, require_chromium
from flexcal.jobs.accuracy import verify_robot
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.pages import compare_folders
from flexcal.jobs.pages.comparison import COMPARISON

RUNS = 5
MEGABYTES, SECONDS = 6.5, 1.5
_PAINT = "performance.getEntriesByName('first-contentful-paint').map(entry => entry.startTime)[0]"
_DRAWN = "document.documentElement.dataset.figures === 'drawn'"
_FETCHED = "performance.getEntriesByType('resource').length"


def run() -> list[tuple[str, float, str]]:
    """Limits over size and time; what is loaded from elsewhere is counted."""
    require_chromium()
    rows = []
    with TemporaryDirectory(prefix="flexcal_pages_") as folder:
        for name, page in _pages(Path(folder)).items():
            size = page.stat().st_size / 1e6
            rows.append((f"{name}: size, limit {MEGABYTES} MB", MEGABYTES / size, f"{size:.2f} MB"))
            paint, bare, drawn, fetched = _measured(page)
            rows.append(
                (
                    f"{name}: first paint, limit {SECONDS} s",
                    SECONDS / paint,
                    f"{paint:.2f} s, {bare:.2f} s with scripts off; all figures after {drawn:.1f} s; {fetched} files loaded besides",
                )
            )
    return rows


def _pages(folder: Path) -> dict[str, Path]:
    """A calibration on 1000 poses, its verification, and a comparison."""
    ur5 = folder / "ur5"
    shutil.copytree(Path(__file__).parent.parent / "examples" / "ur5_tracker", ur5)
    robot, grid, random = (ur5 / name for name in ("robot.yaml", "grid.csv", "random.csv"))
    calibrate_robot(robot, [grid], terms=("kinematic", "gravity_compliance"), out=folder / "fit")
    calibrate_robot(robot, [grid], terms=("kinematic",), out=folder / "rigid")
    verify_robot(robot, [random], estimates=folder / "fit", out=folder / "check")
    compare_folders(folder / "fit", folder / "rigid")
    return {
        "calibration": folder / "fit" / "report.html",
        "verification": folder / "check" / "report.html",
        "comparison": folder / "fit" / COMPARISON,
    }


def _measured(page: Path) -> tuple[float, float, float, int]:
    """Median seconds to the first paint with scripts and without, seconds until the last figure is drawn, and files that were loaded.

    Every time in a browser of its own: a page that is still drawing holds up the next.
    """
    paints: dict[bool, list[float]] = {True: [], False: []}
    for scripts in (True, False) * RUNS:
        with chromium("--window-size=1400,1000") as tab:
            tab.ask("Emulation.setScriptExecutionDisabled", value=not scripts)
            tab.open(page)
            paints[scripts].append(_painted(tab))
    with chromium("--window-size=1400,1000") as tab:
        begun = time.perf_counter()
        tab.open(page)
        while not tab.value(_DRAWN):
            time.sleep(0.1)
        drawn, fetched = time.perf_counter() - begun, tab.value(_FETCHED)
    return sorted(paints[True])[RUNS // 2], sorted(paints[False])[RUNS // 2], drawn, fetched


def _painted(tab: Tab) -> float:
    """Seconds from navigation to the first contentful paint; waits for it."""
    while (found := tab.value(_PAINT)) is None:
        time.sleep(0.05)
    return found / 1e3
