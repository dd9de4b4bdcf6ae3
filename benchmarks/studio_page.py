"""The studio from its command line to the browser: start, judged rows and memory, on the example TX90L (limits: 3 s, 0.3 s and 1 GB).

Start is from the command to the first paint of the page, and to the step on it; Chromium runs already. A row is judged when its sentence is
in the page, from the moment at which another program appended it to the file that is followed; 20 rows are there before. Chromium draws by
SwiftShader at 1280 x 720. What else runs on the machine counts: the note has the mean load of the last minute, and the processor time of
the studio, which does not depend on it.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks._chromium import Tab, chromium, require_chromium, require_viser
from flexcal.data.plans import PosePlan, write_plan
from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.files.formats import read_yaml
from flexcal.jobs.guidance import cells_of
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, VirtualCell

START, JUDGED, MEGABYTES = 3.0, 0.3, 1000.0
BEFORE, ROWS, STARTS = 20, 10, 5
EXAMPLE = Path(__file__).parent.parent / "examples" / "tx90l"
_FOLLOWED = "tracker.csv"
_CHOICES = {"step": "Measure", "row source": "a file that grows", "a file that grows poses.csv": _FOLLOWED}
_SHOWN = """new Promise(done => {
  const there = () => TEXT.test(document.body?.innerText ?? "") && (done(Date.now() / 1000), true);
  if (!there()) { const timer = setInterval(() => there() && clearInterval(timer), 5); }
})"""
_PAINT = "performance.timeOrigin / 1000 + performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000"


def run() -> list[tuple[str, float, str]]:
    """Limits over what is reached."""
    require_chromium()
    require_viser()
    with (
        tempfile.TemporaryDirectory() as place,
        chromium("--use-gl=angle", "--use-angle=swiftshader", "--window-size=1280,720") as tab,
    ):
        folder = Path(place) / "project"
        header, lines = _prepared(folder)
        starts = [_start(folder, tab) for _ in range(STARTS)]
        (folder / _FOLLOWED).write_text("".join([header, *lines[:BEFORE]]))
        (folder / ".studio.json").write_text(json.dumps(_CHOICES))
        judged, busy, peak = _judged(folder, tab, lines[BEFORE:])
    paints, steps, processor = (sorted(times)[STARTS // 2] for times in zip(*starts, strict=True))
    return [
        (
            f"start to the first paint, limit {START:g} s",
            START / paints,
            f"{paints:.2f} s, the step on the page after {steps:.2f} s, {processor:.2f} s of processor time of the studio{_load()}",
        ),
        (
            f"a row judged in the browser, limit {JUDGED:g} s",
            JUDGED / float(np.median(judged)),
            f"{np.median(judged):.3f} s in the median, {max(judged):.3f} s at most, {busy:.3f} s of processor time of the studio{_load()}",
        ),
        (f"memory of the studio, limit {MEGABYTES:g} MB", MEGABYTES / peak, f"{peak:.0f} MB at most"),
    ]


def _load() -> str:
    return f"; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"


def _prepared(folder: Path) -> tuple[str, list[str]]:
    """A folder with the example and a plan; header and lines of the rows that are measured there."""
    folder.mkdir()
    for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
        shutil.copy(EXAMPLE / name, folder / name)
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    setup = MeasuringSetup.declared(model, None, None)
    q = random_candidates(CollisionChecker(model), BEFORE + ROWS, np.random.default_rng(5), setup)
    plan = PosePlan(q=q[: BEFORE + ROWS])
    write_plan(folder / "poses.yaml", plan)
    rows = cells_of(
        VirtualCell.drawn(model, read_yaml(EXAMPLE / "cell.yaml", CellConfig), 1)[0].measure(plan)
    )
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    header, *lines = text.getvalue().splitlines(keepends=True)
    return header, lines


@dataclass
class _Studio:
    process: subprocess.Popen[str]
    url: str

    @property
    def processor_time(self) -> float:
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    @property
    def megabytes(self) -> float:
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1e3


@contextmanager
def _studio(folder: Path) -> Iterator[_Studio]:
    command = [sys.executable, "-m", "flexcal.cli.main", "studio", str(folder), "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        try:
            yield _Studio(process, next(line for line in process.stderr if "http" in line).split()[-1])
        finally:
            process.kill()


def _start(folder: Path, tab: Tab) -> tuple[float, float, float]:
    """Seconds to the first paint and to the step, and of processor time until then."""
    begun = time.time()
    with _studio(folder) as studio:
        tab.ask("Page.navigate", url=studio.url)
        shown = tab.value(_SHOWN.replace("TEXT", "/measured point smr/"))
        return tab.value(_PAINT) - begun, shown - begun, studio.processor_time


def _judged(folder: Path, tab: Tab, lines: list[str]) -> tuple[list[float], float, float]:
    """Seconds from every line that is appended until it is judged in the page, and of processor time; megabytes at most."""
    seconds, busy = [], 0.0
    with _studio(folder) as studio:
        tab.ask("Page.navigate", url=studio.url)
        tab.value(_SHOWN.replace("TEXT", f"/pose {BEFORE} (is|fits)[^]*p90 predicted/"))
        for number, line in enumerate(lines, BEFORE + 1):
            time.sleep(2.0)
            used, begun = studio.processor_time, time.time()
            with (folder / _FOLLOWED).open("a") as stream:
                stream.write(line)
            seconds.append(tab.value(_SHOWN.replace("TEXT", f"/pose {number} (is|fits)/")) - begun)
            busy += studio.processor_time - used
        return seconds, busy / len(lines), studio.megabytes
