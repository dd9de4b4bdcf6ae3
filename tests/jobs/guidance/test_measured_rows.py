"""The project's rows: appended, excluded, included, undone; never half written; and files that another program appends to."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measured_dh_arm import DHArm
from refusals import refused

from flexcal import PoseSet, RobotModel, read_poses
from flexcal.jobs.guidance import FollowedFile, MeasuredRows, RowReader, Source, cells_of, in_columns


@pytest.fixture(scope="module")
def cells() -> list[dict[str, str]]:
    arm = DHArm.drawn(0)
    q = arm.poses(8)
    return [
        {"pose": str(k + 1)}
        | {f"q{i + 1}": repr(float(v)) for i, v in enumerate(one)}
        | dict(zip("xyz", map(repr, point.tolist()), strict=True))
        for k, (one, point) in enumerate(zip(q, arm.measured(q), strict=True))
    ]


def test_rows_come_back_and_are_read_by_the_verbs(
    tmp_path: Path, cells: list[dict[str, str]], ur5: RobotModel
):
    rows = MeasuredRows(tmp_path)
    assert rows.rows() == () and rows.undo() is None
    for one in cells:
        rows.append([one])
    rows.exclude(2, "tripod, bumped\n by the door")
    assert [row.cells for row in rows.rows()] == cells
    poses = read_poses(rows.path, ur5)
    assert poses.pose.tolist() == [1, 2, 4, 5, 6, 7, 8]
    assert poses.notes == ("poses.csv: 1 row is excluded: pose 3 'tripod, bumped by the door'",)
    own = RowReader(rows.path, rows.columns, ur5).poses(
        [row.cells for row in rows.rows() if not row.excluded]
    )
    assert np.array_equal(own.q, poses.q) and np.array_equal(own.position, poses.position)
    assert cells_of(own)[0].items() >= cells[0].items()


def test_undo_takes_back_one_change_at_a_time(tmp_path: Path, cells: list[dict[str, str]]):
    rows = MeasuredRows(tmp_path)
    states = [rows.rows()]
    for change in (
        lambda: rows.append(cells[:2]),
        lambda: rows.exclude(0, "first reason"),
        lambda: rows.exclude(0, "another"),
        lambda: rows.append(cells[2:3]),
        lambda: rows.include(0),
    ):
        change()
        states.append(rows.rows())
    for before in reversed(states[:-1]):
        assert rows.undo() is not None
        assert rows.rows() == before
    assert rows.undo() is None
    # what was taken out is in the journal still
    assert cells[2]["x"] in rows.history.read_text()
    rows.append(cells[:1])
    assert rows.undo() == "1 row taken out"
    rows.append(cells[:2], Source("a.csv", 10))
    rows.append(cells[2:3], Source("b.csv", 5))
    rows.append(cells[3:4], Source("a.csv", 20))
    assert rows.count_taken() == {"a.csv": 3, "b.csv": 1}


def test_a_new_station_and_its_undo(tmp_path: Path, cells: list[dict[str, str]]):
    rows = MeasuredRows(tmp_path)
    rows.append(cells[:5])
    rows.exclude(1, "bumped")
    before = rows.path.read_bytes()
    rows.move_station(3, "tracker2", "tracker")
    once = rows.rows()
    assert [one.cells["station"] for one in once] == ["tracker"] * 3 + ["tracker2"] * 2
    assert once[1].excluded == "bumped" and {**once[4].cells} == {**cells[4], "station": "tracker2"}
    # only those of the same station as the row are moved
    rows.move_station(1, "tracker3", "tracker")
    assert [one.cells["station"] for one in rows.rows()] == ["tracker", "tracker3", "tracker3"] + [
        "tracker2"
    ] * 2
    assert rows.undo() is not None and rows.rows() == once
    assert rows.undo() is not None and rows.path.read_bytes() == before


def test_changes_of_another_program_are_not_taken_back(tmp_path: Path, cells: list[dict[str, str]]):
    rows = MeasuredRows(tmp_path)
    rows.append(cells[:2])
    text = rows.path.read_text()
    rows.path.write_text(text.replace(cells[1]["x"], "0.123"))
    with refused("E-STUDIO-014", str(rows.path)):
        rows.undo()
    with refused("E-STUDIO-012"):
        rows.exclude(2, "there is none")
    with refused("E-STUDIO-011"):
        rows.exclude(0, " ")
    with refused("E-STUDIO-010", "temperature"):
        rows.append([cells[0] | {"temperature": "20"}])


def test_a_row_takes_the_columns_of_a_table_of_another_program(cells: list[dict[str, str]], ur5: RobotModel):
    """Remarks of the table are empty, target and number of the pose are left out or added; no measured number is lost or made up."""
    names = [name for name in cells[0] if name != "pose"]
    plain = {name: cells[0][name] for name in names}
    point = ur5.point().name
    own = cells[0] | {"target": point}
    assert in_columns([own], [*names, "note"], ur5) == [plain | {"note": ""}]
    assert in_columns([plain], [*names, "target"], ur5) == [plain | {"target": point}]
    assert in_columns([own], (), ur5) == [own]
    other, warm = own | {"target": "another"}, own | {"temperature": "20.0"}
    assert in_columns([other], names, ur5) == [plain | {"target": "another"}]
    assert in_columns([warm], names, ur5) == [plain | {"temperature": "20.0"}]
    assert in_columns([plain], [*names, "t"], ur5) == [plain]
    sides = {f"approach{k}": "1.0" for k in range(1, 7)}
    assert in_columns([plain | sides], names, ur5) == [plain]
    assert in_columns([plain], [*names, *sides], ur5) == [plain | dict.fromkeys(sides, "0")]
    assert in_columns([plain | sides], [*names, *sides], ur5) == [plain | sides]


def test_rows_carry_the_sides_of_approach(ur5: RobotModel, tmp_path: Path):
    sides = np.array([[1.0, -1, 0, 1, 1, -1]])
    poses = replace(PoseSet.unmeasured(np.zeros((1, 6)), ur5.point().name, "tracker"), approach=sides)
    (cells,) = cells_of(poses)
    read = RowReader(tmp_path / "poses.csv", tuple(cells), ur5).poses([cells])
    np.testing.assert_array_equal(read.approach, sides)


def test_texts_and_comments_of_a_file_that_is_there_stay(tmp_path: Path, cells: list[dict[str, str]]):
    path = tmp_path / "poses.csv"
    names = list(cells[0])
    path.write_text(
        "# measured on Monday\n"
        + ",".join([*names, "note"])
        + "\n"
        + ",".join([*cells[0].values(), '"a, b"'])
        + "\n"
    )
    rows = MeasuredRows(tmp_path)
    before = path.read_text().splitlines()
    rows.exclude(0, "why")
    assert path.read_text().splitlines() == [before[0], before[1] + ",excluded", before[2] + ",why"]
    rows.include(0)
    assert path.read_text().splitlines() == [before[0], before[1] + ",excluded", before[2] + ","]


def test_a_killed_process_leaves_whole_rows(tmp_path: Path, ur5: RobotModel):
    """kill -9 while rows are appended as fast as possible: the table and its journal agree, and hold all rows but at most the last."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom flexcal.jobs.guidance import MeasuredRows\n"
        "rows = MeasuredRows(Path(sys.argv[1]))\n"
        "for k in range(10**6):\n"
        "    rows.append([{'pose': str(k), **{f'q{i}': '0.1' for i in range(1, 7)}, 'x': '1', 'y': '2', 'z': '3'}])\n"
        "    print(k, flush=True)\n"
    )
    for pause in range(3):
        folder = tmp_path / str(pause)
        folder.mkdir()
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(folder)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        for _ in range(5 + 7 * pause):
            said = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        rest = [int(line) for line in process.stdout.read().split()]
        process.wait()
        said = rest[-1] if rest else said
        rows = MeasuredRows(folder)
        rows.append([{"pose": "-1", **{f"q{i}": "0.1" for i in range(1, 7)}, "x": "1", "y": "2", "z": "3"}])
        numbers = [int(row.cells["pose"]) for row in rows.rows()]
        assert numbers[-1] == -1 and numbers[:-1] == list(range(len(numbers) - 1))
        assert len(numbers) - 1 in (said + 1, said + 2)
        for _ in range(3):
            assert rows.undo() == "1 row taken out"


def test_values_with_odd_line_ends_are_read_back(tmp_path: Path, cells: list[dict[str, str]]) -> None:
    """Only a line feed ends a row; a value that has one is refused."""
    rows = MeasuredRows(tmp_path)
    odd = {**cells[0], "operator": "a\u2028b\x0cc\x85d\x1ce"}
    rows.append([odd])
    assert rows.rows()[0].cells == odd
    with refused("E-STUDIO-052"):
        rows.append([{**odd, "operator": "a\nb"}])
    assert rows.undo() == "1 row taken out"


@pytest.mark.parametrize(
    "line",
    ["5", "[]", '{"do": "append"}', '{"do": "append", "row": 0, "cells": 5}', '{"do": "append", "row": 0, "cells": [{"x": 1}]}',
     '{"do": "append", "row": 0, "cells": [], "from": "a", "end": "x"}', '{"do": "exclude", "row": "0", "reason": "", "before": ""}',
     '{"do": "exclude", "row": 0, "reason": "a", "before": {}}', '{"do": "station", "row": 0, "before": [], "after": [1], "new": true}',
     '{"do": "other"}', "[" * 2000],
)  # fmt: skip
def test_a_journal_of_somebody_else_is_refused(
    line: str, tmp_path: Path, cells: list[dict[str, str]]
) -> None:
    rows = MeasuredRows(tmp_path)
    rows.append(cells[:1])
    with rows.history.open("a") as stream:
        stream.write(line + "\n")
    for use in (rows.undo, rows.taken, rows.count_taken):
        with refused("E-STUDIO-013"):
            use()


def test_a_followed_file_gives_complete_lines_only(
    tmp_path: Path, cells: list[dict[str, str]], ur5: RobotModel
):
    path = tmp_path / "tracker.csv"
    followed = FollowedFile(path, ur5)
    assert followed.new_rows() == []
    text = ",".join(cells[0]) + "\r\n" + "".join(",".join(one.values()) + "\r\n" for one in cells)
    got: list[dict[str, str]] = []
    for end in range(0, len(text) + 1, 37):
        path.write_bytes(text[:end].encode())
        got += followed.new_rows()
        assert got == cells[: len(got)]
    path.write_bytes(text.encode())
    assert got + followed.new_rows() == cells
    with path.open("ab") as stream:
        stream.write(b"9,0.1,0.2\n" + ",".join(cells[0].values()).encode() + b"\n")
    with refused("E-STUDIO-017", "9,0.1,0.2"):
        followed.new_rows()
    assert followed.new_rows() == cells[:1]
    path.write_bytes(text[:200].encode())
    with refused("E-STUDIO-016"):
        followed.new_rows()


@pytest.mark.parametrize(
    "header", ["Point;X [mm];Y [mm];Z [mm]", "J1,J2,J3,J4,J5,J6,X,Y,Z", "pose;q1;q2;q3;q4;q5;q6;x;y;z"]
)
def test_a_followed_file_of_other_columns_names_import(tmp_path: Path, header: str, ur5: RobotModel):
    path = tmp_path / "other.csv"
    path.write_text(header + "\n")
    for _ in range(2):
        with refused("E-STUDIO-008", "flexcal import"):
            FollowedFile(path, ur5).new_rows()


def test_a_followed_file_goes_on_where_its_rows_were_taken(
    tmp_path: Path, cells: list[dict[str, str]], ur5: RobotModel
):
    """How far it was read is kept with the rows, whatever becomes of them; a file that was written anew is read from its start."""
    path = tmp_path / "tracker.csv"
    lines = [",".join(cells[0]), *(",".join(one.values()) for one in cells)]
    path.write_text("\n".join(lines[:4]) + "\n" + lines[4][:10])
    rows = MeasuredRows(tmp_path)
    followed = FollowedFile(path, ur5)
    rows.append(followed.new_rows(), Source("tracker.csv", followed.end))
    rows.undo()
    assert rows.rows() == () and rows.taken() == {"tracker.csv": len("\n".join(lines[:4])) + 1}
    path.write_text("\n".join(lines[:6]) + "\n")
    followed = FollowedFile(path, ur5, rows.taken()["tracker.csv"])
    assert followed.new_rows() == cells[3:5] and followed.end == path.stat().st_size
    path.write_text("\n".join(lines[:2]) + "\n")
    with refused("E-STUDIO-016"):
        followed.new_rows()
    assert followed.new_rows() == cells[:1]


@pytest.mark.parametrize("again", [False, True])
def test_a_line_that_goes_on_after_it_was_taken_is_said(
    tmp_path: Path, cells: list[dict[str, str]], ur5: RobotModel, again: bool
):
    """Whether the same program follows on or another begins; an end of line that comes late is none of it."""
    path = tmp_path / "shot.csv"
    lines = [",".join(cells[0]), *(",".join(one.values()) for one in cells)]
    followed = FollowedFile(path, ur5)

    def write(text: str) -> list[dict[str, str]]:
        nonlocal followed
        path.write_text(text)
        if again:
            followed = FollowedFile(path, ur5, followed.end)
        return followed.new_rows(is_whole=True)

    text = "\n".join(lines[:2])
    assert write(text) == cells[:1]
    text += "\n" + lines[2][:-3]
    cut = cells[1] | {"z": cells[1]["z"][:-3]}
    assert write(text) == [cut]
    text += lines[2][-3:] + "\n"
    with refused("E-STUDIO-051", f"'{lines[2][-3:]}' behind it"):
        write(text)
    text += lines[3] + "\n"
    assert write(text) == cells[2:3]


def test_rows_to_verify_on_have_a_journal_of_their_own(tmp_path: Path, cells: list[dict[str, str]]):
    first, second = MeasuredRows(tmp_path), MeasuredRows(tmp_path, "others.csv")
    first.append(cells[:2])
    second.append(cells[2:3])
    first.undo()
    assert [row.cells for row in second.rows()] == cells[2:3] and first.rows() == ()
    assert second.undo() == "1 row taken out" and second.undo() is None
