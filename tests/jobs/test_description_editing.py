"""robot.yaml is edited with every other byte kept, and all that is wrong in it is found at its line."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

from flexcal.files.formats import REMOVED
from flexcal.jobs.setup import description_problems, edit_robot

URDF = """<robot name="r">
  <link name="base"/><link name="arm"/><link name="tool"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="10" velocity="1"/></joint>
  <joint name="j2" type="revolute"><parent link="arm"/><child link="tool"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="10" velocity="1"/></joint>
</robot>
"""
TEXT = (
    "# Zelle ä\r\nrobot: 'r.urdf'   # the URDF\r\npoints:\r\n  \"smr\": {frame: tool, xyz: [0, 0,   # flat\r\n    0.1]}\r\n"
    "payload:\r\n  frame: tool   # flange\r\n  mass: 1.0\r\n  com: [0, 0, 0.05]\r\n"
)


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "r.urdf").write_text(URDF)
    path = tmp_path / "robot.yaml"
    path.write_bytes(TEXT.encode())
    return path


def test_changes_are_made_together(robot: Path) -> None:
    edit_robot(
        robot,
        {
            ("points", "smr", "xyz"): (0.001, 0.0, 0.25),
            ("payload", "mass"): 2.5,
            ("points", "second"): {"frame": "arm", "xyz": [0.0, 0.0, 0.0]},
            ("stations",): {"tracker": {"xyz": [1.0, 2.0, 3.0]}},
        },
    )
    expected = TEXT.replace("[0, 0,   # flat\r\n    0.1]}", "[0.001, 0.0,   # flat\r\n    0.25]}").replace(
        "mass: 1.0", "mass: 2.5"
    )
    expected = expected.replace("0.25]}\r\n", "0.25]}\r\n  second: {frame: arm, xyz: [0.0, 0.0, 0.0]}\r\n")
    expected += "stations: {tracker: {xyz: [1.0, 2.0, 3.0]}}\r\n"
    assert robot.read_bytes().decode() == expected and description_problems(robot) == []
    edit_robot(robot, {("payload",): REMOVED, ("stations",): REMOVED, ("points", "second"): REMOVED})
    assert b"payload" not in robot.read_bytes() and b"# flat" in robot.read_bytes()


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({("payload", "mass"): 2.0, ("payload", "com"): [0.0, 1.0]}, "E-YAML-024"),
        ({("payload", "mass"): 2.0, ("payload", "mess"): 1.0}, "E-YAML-001"),
        ({("payload", "mass"): -2.0}, "E-ROBOT-007"),
        ({("payload", "frame"): REMOVED}, "E-YAML-002"),
        ({("payload", "mass"): 2.0, ("payload", "inertia"): REMOVED}, "E-YAML-036"),
    ],
)
def test_what_would_not_read_changes_nothing(robot: Path, changes, code: str) -> None:
    with refused(code, "robot.yaml"):
        edit_robot(robot, changes)
    assert robot.read_bytes() == TEXT.encode()


def test_a_file_with_a_fault_can_be_mended(robot: Path) -> None:
    robot.write_text(TEXT.replace("mass: 1.0", "mass: heavy").replace("flange", "nothing"))
    edit_robot(robot, {("points", "smr", "frame"): "arm"})
    with refused("E-YAML-025"):
        edit_robot(robot, {("payload", "com"): ["a", 0, 0]})
    assert [problem.code for problem in description_problems(robot)] == ["E-YAML-025"]
    edit_robot(robot, {("payload", "mass"): 3})
    assert description_problems(robot) == []


def found(robot: Path, text: str) -> list[tuple[int, int, str]]:
    robot.write_bytes(text.encode())
    problems = description_problems(robot)
    assert all(
        item.sentence.endswith((".", "?")) and "robot.yaml line" not in item.sentence for item in problems
    )
    return [(item.line, item.column, item.code) for item in problems]


def test_all_keys_and_types_are_found_at_their_places(robot: Path) -> None:
    text = (
        "robot: r.urdf\r\npoint: {}\r\npoints:\r\n  smr: {frame: tool, xyz: [0, 0],\r\n    stdd: 1}   # x\r\n"
        "payload: {frame: tool, mass: true,\r\n     com: [0, 0, a]}\r\ngravity: 9.81\r\n"
    )
    assert found(robot, text) == [
        (2, 1, "E-YAML-001"),
        (4, 22, "E-YAML-024"),
        (5, 5, "E-YAML-001"),
        (6, 24, "E-YAML-025"),
        (7, 18, "E-YAML-025"),
        (8, 1, "E-YAML-023"),
    ]


def test_what_does_not_go_with_the_urdf_is_found_together(robot: Path) -> None:
    text = (
        "robot: r.urdf\npoints:\n  a: {frame: tol, xyz: [0, 0, 0]}\n  b: {frame: arm, xyz: [0, 0, 0]}\n"
        "  c: {frame: base, xyz: [0, 0, 0]}\n"
        "payload: {frame: nowhere, mass: 1, com: [0, 0, 0]}\ngeometry: {backlash: [j3]}\n"
        "elastic:\n  - {joint: j2, drive: {stiffness: 1000}}\n  - {joint: j9, drive: {stiffness: 1000}}\n"
    )
    assert [(line, code) for line, _, code in found(robot, text)] == [
        (3, "E-ROBOT-028"),
        (5, "E-ROBOT-029"),
        (6, "E-ROBOT-028"),
        (7, "E-ROBOT-027"),
        (10, "E-ROBOT-027"),
    ]


def test_what_is_no_yaml_has_one_problem(robot: Path) -> None:
    assert found(robot, "robot: r.urdf\npoints:\n\tsmr: 1\n")[0][0] == 3
    assert found(robot, "robot: r.urdf\nrobot: r.urdf\n") == [(2, 1, "E-YAML-014")]
    assert found(robot, "robot: [\n") and found(robot, "") == [(1, 1, "E-YAML-006")]
    robot.write_bytes(b"robot: \xff\n")
    assert [item.code for item in description_problems(robot)] == ["E-YAML-016"]
    robot.unlink()
    assert [item.code for item in description_problems(robot)] == ["E-FILE-001"]


def test_problems_of_the_urdf_name_it_and_its_line(robot: Path) -> None:
    urdf = robot.parent / "r.urdf"
    urdf.write_text(URDF.replace("0 0 1", "0 0 x", 1))
    (problem,) = description_problems(robot)
    assert (problem.path, problem.line, problem.code) == (urdf, 3, "E-URDF-028")
    urdf.unlink()
    (problem,) = description_problems(robot)
    assert (problem.path.name, problem.line, problem.code) == ("robot.yaml", 2, "E-URDF-021")
