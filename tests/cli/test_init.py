"""`flexcal init`: what it guesses, what it asks for, and that it never writes over a file."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_files import snapshot
from newcomer_robot import JOINTS, urdf_text
from refusals import assert_refusal

from flexcal.model.robot import RobotModel

ARM = """<link name="{side}_{k}"/><joint name="{side}_joint_{k}" type="{kind}"><parent link="{parent}"/><child link="{side}_{k}"/>
<axis xyz="0 {k} 1"/><origin xyz="0.1 0 0.2"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""

_SHOULDER = '<limit lower="-2.0" upper="2.0" effort="300" velocity="3"/>'
MIMICKING = urdf_text().replace(_SHOULDER, f'{_SHOULDER}<mimic joint="elbow"/>')


def chain(side: str, count: int, kind: str = "revolute") -> str:
    """Joints side_joint_1 … from the base on."""
    return "".join(
        ARM.format(side=side, k=k, kind=kind, parent=f"{side}_{k - 1}" if k > 1 else "base")
        for k in range(1, count + 1)
    )


def robot(tmp_path: Path, *parts: str) -> Path:
    path = tmp_path / "some robot.urdf"
    path.write_text(f'<robot name="some"><link name="base"/>{"".join(parts)}</robot>')
    return path


def test_writes_what_loads_and_names_what_it_guessed(run, tmp_path: Path) -> None:
    (tmp_path / "newcomer.urdf").write_text(urdf_text())
    outcome = run("init", tmp_path / "newcomer.urdf", "--out", tmp_path / "cell" / "deep", "--json")
    document = outcome.document
    assert outcome.status == 0 and document["joints"] == list(JOINTS)
    assert document["locked"] == {"finger_left": 0.01, "finger_right": 0.01}
    assert document["frame"] == "flange" and document["frames"] == ["flange", "link6"]
    assert any("no collision shapes" in remark for remark in document["remarks"])
    model = RobotModel.from_yaml(document["file"])
    assert model.joint_names == JOINTS and model.point().frame == "flange"
    text = Path(document["file"]).read_text()
    assert "#   q5  wrist" in text and "-2.1 to 2.1 rad (-120.3 to 120.3 deg)" in text
    assert "robot: ../../newcomer.urdf" in text


def test_the_commented_templates_are_valid(run, tmp_path: Path) -> None:
    """With every template taken out of its comment the file still loads."""
    (tmp_path / "newcomer.urdf").write_text(urdf_text())
    run("init", tmp_path / "newcomer.urdf", "--out", tmp_path)
    path = tmp_path / "robot.yaml"
    keys = ("payload", "stations", "working_volume", "geometry", "drives", "elastic", "signals")
    lines, inside = [], False
    for line in path.read_text().splitlines():
        inside = line.startswith(tuple(f"# {key}:" for key in keys)) or (inside and line.startswith("#   "))
        lines.append(line.removeprefix("# ") if inside else line)
    path.write_text("\n".join(lines))
    model = RobotModel.from_yaml(path)
    assert model.payload is not None and len(model.elastic) == 1 and set(model.config.signals) == {"q", "tau"}
    assert model.config.stations and model.config.working_volume and model.backlash_joints == (1,)


def test_never_writes_over_a_file(run, tmp_path: Path) -> None:
    urdf = robot(tmp_path, chain("left", 6))
    (tmp_path / "robot.yaml").write_text("mine\n")
    before = snapshot(tmp_path)
    outcome = run("init", urdf, "--out", tmp_path)
    assert outcome.status == 2 and snapshot(tmp_path) == before
    assert f"go on with 'flexcal design poses {tmp_path / 'robot.yaml'}" in outcome.err


@pytest.mark.parametrize(
    ("name", "content", "refusal"),
    [
        ("arm.urdf", "solid arm\n", ["E-URDF-030", "arm.urdf"]),
        ("arm.urdf", "<mujoco/>", ["E-URDF-001", "mujoco"]),
        ("robot.yaml", "mine\n", ["E-URDF-030", "robot.yaml"]),
        ("missing.urdf", None, ["E-URDF-035", "missing.urdf"]),
        (".", None, ["E-URDF-034"]),
    ],
)
def test_a_wrong_urdf_beside_a_robot_yaml(
    run, tmp_path: Path, name: str, content: str | None, refusal: list[str]
) -> None:
    """The sentence is about the file that was named, whatever else is there."""
    (tmp_path / "robot.yaml").write_text("mine\n")
    if content is not None:
        (tmp_path / name).write_text(content)
    before = snapshot(tmp_path)
    outcome = run("init", tmp_path / name, "--out", tmp_path)
    assert outcome.status == 2 and "there already" not in outcome.err
    assert_refusal(outcome.err, *refusal)
    assert snapshot(tmp_path) == before


def test_a_urdf_that_cannot_be_loaded_leaves_no_folder(run, tmp_path: Path) -> None:
    """A joint and a link of one name show only when robot.yaml is read back."""
    urdf = robot(tmp_path, chain("left", 6).replace("left_joint_2", "left_4"))
    outcome = run("init", urdf, "--out", tmp_path / "deep" / "cell")
    assert outcome.status == 2 and list(tmp_path.iterdir()) == [urdf]
    assert_refusal(outcome.err, "E-URDF-023", "left_4")


def test_two_arms_ask_for_the_tip(run, tmp_path: Path) -> None:
    urdf = robot(tmp_path, chain("left", 6), chain("right", 7))
    asked = run("init", urdf, "--out", tmp_path)
    assert asked.status == 2
    assert_refusal(asked.err, "E-URDF-041")
    assert_refusal(asked.err, "E-URDF-041", "left_6 (6 joints)", "right_7 (7 joints)")
    document = run("init", urdf, "--out", tmp_path, "--tip", "right_7", "--json").document
    assert document["joints"] == [f"right_joint_{k}" for k in range(1, 8)]
    assert (
        document["locked"] == {f"left_joint_{k}": 0 for k in range(1, 7)} and document["frame"] == "right_7"
    )


def test_a_short_branch_beside_the_arm_is_locked(run, tmp_path: Path) -> None:
    document = run(
        "init", robot(tmp_path, chain("arm", 6), chain("camera", 2)), "--out", tmp_path, "--json"
    ).document
    assert document["joints"] == [f"arm_joint_{k}" for k in range(1, 7)]
    assert set(document["locked"]) == {"camera_joint_1", "camera_joint_2"}


def test_joints_without_limits(run, tmp_path: Path) -> None:
    outcome = run("init", robot(tmp_path, chain("arm", 3, "continuous")), "--out", tmp_path)
    assert outcome.status == 0
    assert (
        "continuous" in (tmp_path / "robot.yaml").read_text()
        or "without limits" in (tmp_path / "robot.yaml").read_text()
    )


@pytest.mark.parametrize(
    ("content", "name", "refusal"),
    [
        ("", "a.urdf", ["E-URDF-030", "a.urdf"]),
        ("<robot name='x'>", "a.urdf", ["E-URDF-031"]),
        ("<robot name='x'/>", "a.urdf.xacro", ["E-URDF-033", "a.urdf", "xacro"]),
        ("<robot name='x' xmlns:xacro='u'><xacro:macro name='m'/></robot>", "a.urdf", ["E-URDF-033", "a.urdf", "line 1", "xacro:macro"]),
        ("<robot name='x'><link name='a'/></robot>", "a.urdf", ["E-URDF-036"]),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_a_sentence(
    run, tmp_path: Path, content: str, name: str, refusal: list[str]
) -> None:
    (tmp_path / name).write_text(content)
    before = snapshot(tmp_path)
    outcome = run("init", tmp_path / name, "--out", tmp_path / "new")
    assert outcome.status == 2 and outcome.out == "" and outcome.err.count("\n") == 1
    assert_refusal(outcome.err, *refusal)
    assert snapshot(tmp_path) == before


def test_a_joint_of_the_arm_that_mimics_another_follows_it(run, tmp_path: Path) -> None:
    (tmp_path / "a.urdf").write_text(MIMICKING)
    document = run("init", tmp_path / "a.urdf", "--out", tmp_path, "--json").document
    assert (
        document["joints"] == [name for name in JOINTS if name != "shoulder"]
        and "elbow" not in document["locked"]
    )
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    assert model.motor_names == tuple(document["joints"]) and "shoulder" in model.joint_names
    assert "shoulder" in next(
        line for line in (tmp_path / "robot.yaml").read_text().splitlines() if "follows others" in line
    )


def test_unknown_tip_is_suggested(run, tmp_path: Path) -> None:
    outcome = run("init", robot(tmp_path, chain("left", 6)), "--out", tmp_path, "--tip", "left_66")
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-URDF-037", "left_6")


def test_units_of_joints_that_slide(run, tmp_path: Path) -> None:
    """deg suits no joint that slides, and one unit no robot that does both; its template still loads."""
    urdf = robot(
        tmp_path,
        chain("arm", 2),
        chain("arm", 3).split("</joint>")[2].replace("revolute", "prismatic") + "</joint>",
    )
    run("init", urdf, "--out", tmp_path)
    path = tmp_path / "robot.yaml"
    text = path.read_text()
    assert (
        "unit: deg" not in text
        and "#   q: {columns: [J1, J2, J3], gain: [0.01745329252, 0.01745329252, 0.001]}" in text
    )
    assert "N m; of arm_joint_3: kg, N s/m, N." in text and "- joint: arm_joint_2" in text
    path.write_text(text.replace("# signals:", "signals:").replace("#   q: {", "  q: {"))
    assert RobotModel.from_yaml(path).config.signals["q"].gain[2] == 0.001
