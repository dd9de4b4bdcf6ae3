"""Rows that other programs write, taken by a studio that nobody looks at."""

from __future__ import annotations

import csv
import json
import shutil
import time
from pathlib import Path

import pytest
from browser import studio
from waiting import until

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"
HEADER = "q1,q2,q3,q4,q5,q6,x,y,z\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(EXAMPLE / name, tmp_path / name)
    return tmp_path


def follow(project: Path, source: str, name: str) -> None:
    choices = {"step": "Measure", "row source": source, f"{source} poses.csv": name}
    (project / ".studio.json").write_text(json.dumps(choices))


def line(value: float) -> str:
    return ",".join([repr(value)] * 9)


def taken(project: Path) -> list[float]:
    table = project / "poses.csv"
    return (
        [float(row["x"]) for row in csv.DictReader(table.read_text().splitlines())] if table.is_file() else []
    )


def test_a_folder_with_a_file_a_measurement(project: Path) -> None:
    """In the order in which they came, with or without an end of line, each once, whatever the restarts."""
    follow(project, "a watched folder", "shots")
    place = project / "shots"
    place.mkdir()
    with studio(project):
        (place / "b.csv").write_text(HEADER + line(0.25) + "\n")
        until(lambda: taken(project) == [0.25])
        (place / "a.csv").write_text(HEADER + line(0.5))
        until(lambda: taken(project) == [0.25, 0.5])
        (place / "note.txt").write_text("no measurement")
    with studio(project):
        (place / "c.csv").write_text(HEADER + line(0.75) + "\n" + line(0.125) + "\n")
        until(lambda: len(taken(project)) >= 4)
        time.sleep(0.5)
    assert taken(project) == [0.25, 0.5, 0.75, 0.125]


def test_lines_that_are_no_measurements_are_left_out(project: Path) -> None:
    follow(project, "a file that grows", "tracker.csv")
    wrong = ["0.1,0.2", line(0.25).replace("0.25", "beam lost", 1), "# a remark", ""]
    text = HEADER + line(0.5) + "\n" + "".join(f"{one}\n" for one in wrong) + line(0.75) + "\n"
    (project / "tracker.csv").write_text(text)
    with studio(project):
        until(lambda: len(taken(project)) >= 2)
        time.sleep(0.3)
    assert taken(project) == [0.5, 0.75]


def test_no_file_outside_the_project_is_followed(
    project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside")
    (outside / "tracker.csv").write_text(HEADER + line(0.5) + "\n")
    (project / "link").symlink_to(outside)
    for name in ("link/tracker.csv", f"../{outside.name}/tracker.csv", str(outside / "tracker.csv")):
        follow(project, "a file that grows", name)
        with studio(project) as running:
            time.sleep(0.7)
            assert running.alive
        assert taken(project) == []
