"""Bad files and declarations of every kind of measurement: refused in a sentence, or found and said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from refusals import assert_refusal
from stranger_readings import ReadArm, readings, right

from flexcal import RobotModel, calibrate, read_poses

KINDS = ("camera", "line", "plane", "sockets", "sphere", "wire")
Edit = Callable[[str], str]


def same(text: str) -> str:
    return text


def cell(column: str, value: Edit, rows: slice) -> Edit:
    """Edit of some cells of a column."""

    def edited(text: str) -> str:
        header, *lines = [line.split(",") for line in text.splitlines()]
        for line in lines[rows]:
            line[header.index(column)] = value(line[header.index(column)])
        return "\n".join(map(",".join, [header, *lines])) + "\n"

    return edited


def xyzw(rows: slice) -> Edit:
    """Quaternions of some rows in the other order."""

    def edited(text: str) -> str:
        header, *lines = [line.split(",") for line in text.splitlines()]
        first = header.index("qw")
        for line in lines[rows]:
            line[first : first + 4] = [*line[first + 1 : first + 4], line[first]]
        return "\n".join(map(",".join, [header, *lines])) + "\n"

    return edited


def shrunk(text: str) -> str:
    """A quaternion of norm 0.7."""
    for name in ("qw", "qx", "qy", "qz"):
        text = cell(name, lambda v: repr(0.7 * float(v)), slice(4, 5))(text)
    return text


def foreign(header: str, value: str) -> Edit:
    """A further column."""

    def edited(text: str) -> str:
        first, *lines = text.splitlines()
        return "\n".join([f"{first},{header}", *(f"{line},{value}" for line in lines)]) + "\n"

    return edited


def without_block(text: str) -> str:
    return text[: text.index("measurements")]


ONE = slice(2, 3)
BAD: list[tuple[str, Edit, Edit, str, tuple[str, ...]]] = [
    ("poses", shrunk, same, "E-POSES-014", ("0.7", "qw")),
    ("poses", xyzw(slice(12, None)), same, "E-CAL-024", ("12 of 24", "13, 14", "order")),
    ("wire", cell("length", lambda v: "-0.3", ONE), same, "E-POSES-011", ("length", "-0.3")),
    ("wire", cell("length", lambda v: "0", ONE), same, "E-POSES-011", ("length",)),
    (
        "wire",
        same,
        lambda y: y.replace("kind: wire", "kind: wyre"),
        "E-YAML-034",
        ("east", *KINDS, "'wire'?"),
    ),
    ("wire", same, lambda y: y.replace("kind: wire, ", ""), "E-YAML-002", ("kind", "east")),
    ("wire", same, without_block, "E-POSES-059", ("lengths", "kind: wire")),
    ("plane", same, without_block, "E-POSES-058", ("touched", "kind: plane")),
    ("sockets", same, without_block, "E-POSES-039", ("socket", "kind: sockets")),
    ("wire", foreign("x,y,z", "1,1,1"), same, "E-POSES-057", ("length", "x, y, z")),
    ("wire", foreign("humidity", "1"), same, "E-TABLE-004", ("humidity",)),
    ("sockets", foreign("length", "1"), same, "E-TABLE-004", ("length",)),
    ("points", foreign("touched", "table"), same, "E-POSES-018", ("touched",)),
    ("points", foreign("socket", "a"), same, "E-TABLE-004", ("socket",)),
    ("wire", same, lambda y: y.replace("std: 5e-05", "std: 0"), "E-ROBOT-056", ("east", "std")),
    ("plane", same, lambda y: y.replace("std: 5e-05", "std: -1"), "E-ROBOT-056", ("plane0", "std")),
    ("points", cell("sigma", lambda v: "0", ONE), same, "E-POSES-011", ("sigma",)),
    ("wire", lambda t: t.replace("east", "East"), same, "E-POSES-061", ("East", "east")),
    ("plane", lambda t: t.replace("plane1", "Plane1"), same, "E-POSES-061", ("Plane1", "plane1")),
    ("sockets", lambda t: t.replace(",b,", ",B,"), same, "E-POSES-037", ("B", "a, b")),
    ("sockets", lambda t: t.replace("place0,b", "Place0,b"), same, "E-POSES-063", ("place0", "Place0")),
]


@pytest.mark.parametrize(("kind", "file", "yaml", "code", "named"), BAD)
def test_it_is_refused(
    tmp_path: Path, run: Callable, kind: str, file: Edit, yaml: Edit, code: str, named: tuple[str, ...]
) -> None:
    readings(tmp_path, ReadArm.drawn(3), [right(kind, 24)], 3)
    robot, rows = tmp_path / "robot.yaml", tmp_path / f"0_{kind}.csv"
    robot.write_text(yaml(robot.read_text()))
    rows.write_text(file(rows.read_text()))
    outcome = run("calibrate", robot, rows)
    assert (outcome.status, outcome.out) == (2, "")
    assert_refusal(outcome.err, code, *named)


def remarks(folder: Path, kind: str, count: int, edit: Edit) -> list[str]:
    """Remarks of a calibration from an edited file of a kind."""
    model, _ = readings(folder, ReadArm.drawn(3), [right(kind, count)], 3)
    file = folder / f"0_{kind}.csv"
    file.write_text(edit(file.read_text()))
    return list(calibrate(model, read_poses(file, model), terms=["kinematic"]).document()["remarks"])


def test_a_length_that_no_place_of_the_wire_allows_is_found(tmp_path: Path) -> None:
    said = remarks(tmp_path, "wire", 90, cell("length", lambda v: "0.05", ONE))
    assert any(remark.startswith("1 outlier: pose 3 (1") for remark in said)


def test_orientations_of_another_convention_among_others_are_said(tmp_path: Path) -> None:
    said = remarks(tmp_path, "poses", 30, xyzw(slice(0, None, 5)))
    assert any(remark.startswith("6 of 30 orientations differ") for remark in said)


def test_a_ball_beside_its_socket_is_found(tmp_path: Path) -> None:
    """By 2 mm, in one row."""
    arm, row = ReadArm.drawn(3), 25

    def moved(text: str) -> str:
        header, *lines = [line.split(",") for line in text.splitlines()]
        q = np.array([[float(v) for v in lines[row][2:]]])
        goal = arm.points(q)[0] + [0, 2e-3, 0]
        for _ in range(10):
            now = arm.points(q)[0]
            slopes = np.array([(arm.points(q + 1e-6 * e)[0] - now) / 1e-6 for e in np.eye(6)]).T
            q = q - np.linalg.pinv(slopes) @ (now - goal)
        lines[row][2:] = map(repr, q[0].tolist())
        return "\n".join(map(",".join, [header, *lines])) + "\n"

    said = remarks(tmp_path, "sockets", 120, moved)
    assert any(remark.startswith("1 outlier: pose 26 (") and "place1 a" in remark for remark in said)


def test_an_instrument_without_readings_is_said(tmp_path: Path) -> None:
    model, poses = readings(tmp_path, ReadArm.drawn(3), [right("points", 30), right("wire", 24)], 3)
    assert isinstance(model, RobotModel)
    points = poses.subset(poses.located)
    said = calibrate(model, points, terms=["kinematic"]).document()["remarks"]
    assert said[0] == "robot.yaml declares east under `measurements:`, of which no file has readings"
