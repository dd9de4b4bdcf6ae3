"""A studio that is killed while rows arrive: no row is lost, none doubled."""

from __future__ import annotations

import csv
import json
import shutil
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from browser import studio
from waiting import until

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"
COUNT = 90
KILLS = 6


def test_killed_again_and_again_while_a_file_grows(tmp_path: Path) -> None:
    """Killed at random moments, while the writer appends lines in pieces, in three of six rounds as soon as a row is being written.

    The writer goes on in each round when its studio is there, however long that takes.
    """
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(EXAMPLE / name, folder / name)
    chosen = {
        "step": "Measure",
        "row source": "a file that grows",
        "a file that grows poses.csv": "tracker.csv",
    }
    (folder / ".studio.json").write_text(json.dumps(chosen))
    rng = np.random.default_rng(3)
    values = rng.uniform(-1, 1, (COUNT, 9))
    lines = [f"{k + 1}," + ",".join(map(repr, row)) + "\n" for k, row in enumerate(values.tolist())]
    text = "pose,q1,q2,q3,q4,q5,q6,x,y,z\n" + "".join(lines)
    rounds = threading.Semaphore(0)

    def write() -> None:
        pieces = [text[start : start + 97] for start in range(0, len(text), 97)]
        with (folder / "tracker.csv").open("w", buffering=1) as stream:
            for number, piece in enumerate(pieces):
                if number * (KILLS + 1) % len(pieces) < KILLS + 1:
                    rounds.acquire()
                stream.write(piece)
                stream.flush()
                time.sleep(0.05)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    table, seen = folder / "poses.csv", []
    for k in range(KILLS):
        with studio(folder) as running:
            before = _modified(table)
            rounds.release()
            if k % 2:
                until(lambda before=before: _modified(table) != before)
            else:
                time.sleep(float(rng.uniform(0.0, 0.8)))
            running.kill()
        seen.append(_count(table))
    rounds.release()
    writer.join()
    with studio(folder):
        until(lambda: _count(table) >= COUNT)
        time.sleep(0.5)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [int(row["pose"]) for row in rows] == list(range(1, COUNT + 1))
    there = [
        [float(row[name]) for name in ("q1", "q2", "q3", "q4", "q5", "q6", "x", "y", "z")] for row in rows
    ]
    assert there == values.tolist()
    assert sorted(seen) == seen and any(0 < count < COUNT for count in seen), seen


def _modified(path: Path) -> int:
    return path.stat().st_mtime_ns if path.exists() else 0


def _count(path: Path) -> int:
    return path.read_text().count("\n") - 1 if path.exists() else 0
