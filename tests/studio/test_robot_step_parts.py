"""Parts of the robot's step: uploads, examples, places, sliders, problems beside their lines."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import cast
from xml.etree import ElementTree

import numpy as np
import pytest
from refusals import refused

from flexcal.jobs.setup import description_problems, edit_robot, urdf_robot
from flexcal.model.robot import RobotModel
from flexcal.studio.project import Project
from flexcal.studio.steps.robot.examples import Example, examples_here
from flexcal.studio.steps.robot.joint_sliders import slider_range, slider_units
from flexcal.studio.steps.robot.mesh_places import mesh_places
from flexcal.studio.steps.robot.places import Place, places_of
from flexcal.studio.steps.robot.problem_listing import problem_listing
from flexcal.studio.steps.robot.robot_file import RobotFile
from flexcal.studio.steps.robot.uploads import LARGEST, write_upload
from flexcal.studio.steps.robot.urdf_choice import arm_ends
from flexcal.studio.window import Window

EXAMPLES = Path(__file__).parents[2] / "examples"
URDF = (EXAMPLES / "servo_arm" / "arm.urdf").read_bytes()
MESHED = b"""<robot name="r"><link name="base"><visual><geometry><mesh filename="package://arm/meshes/base.stl"/></geometry></visual></link>
<link name="a"><visual><geometry><mesh filename="../outside.stl"/></geometry></visual>
<collision><geometry><mesh filename="package://arm/twice/x.obj"/></geometry></collision></link>
<link name="b"><collision><geometry><mesh filename="package://arm/x.obj"/></geometry></collision></link></robot>"""


@pytest.fixture
def project(tmp_path: Path) -> Project:
    folder = tmp_path / "project"
    folder.mkdir()
    return Project.open(folder)


def contents(project: Project) -> dict[str, bytes]:
    """Every file beside and below the project's folder."""
    top = project.folder.parent
    return {p.relative_to(top).as_posix(): p.read_bytes() for p in top.rglob("*") if p.is_file()}


def test_uploaded_urdf_is_in_the_folder(project: Project) -> None:
    assert write_upload(project, "my arm.xml", URDF, replace=False) == project.folder / "my arm.urdf"
    assert contents(project) == {"project/my arm.urdf": URDF}


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("../../x.urdf", URDF, "E-STUDIO-020"),
        ("sub/x.urdf", URDF, "E-STUDIO-020"),
        ("..\\x.urdf", URDF, "E-STUDIO-020"),
        ("a<b>.urdf", URDF, "E-STUDIO-020"),
        (".urdf", URDF, "E-STUDIO-020"),
        (".hidden.urdf", URDF, "E-STUDIO-020"),
        ("x\0.urdf", URDF, "E-STUDIO-020"),
        ("a\n.urdf", URDF, "E-STUDIO-020"),
        ("x" * 200 + ".urdf", URDF, "E-STUDIO-020"),
        ("", URDF, "E-STUDIO-020"),
        ("x.urdf", b"", "E-STUDIO-021"),
        ("x.urdf.xacro", URDF, "E-URDF-033"),
        ("x.urdf", URDF.replace(b"<link ", b"<xacro:link ", 1), "E-URDF-033"),
        ("robot.yaml", b"robot: x.urdf", "E-STUDIO-023"),
        ("x.urdf", bytes(LARGEST + 1), "E-STUDIO-025"),
        ("x.urdf", b"<svg/>", "E-STUDIO-026"),
        ("x.urdf", b"<robot/>", "E-STUDIO-026"),
        ("x.urdf", b"\x89PNG\r\n", "E-URDF-030"),
        ("x.urdf", b"<robot><link></robot>", "E-URDF-031"),
        ("base.stl", b"solid", "E-STUDIO-028"),
    ],
)
def test_bad_uploads_write_nothing(project: Project, name: str, content: bytes, code: str) -> None:
    with refused(code):
        write_upload(project, name, content, replace=True)
    assert contents(project) == {}


def test_a_file_is_replaced_only_when_told(project: Project) -> None:
    write_upload(project, "arm.urdf", URDF, replace=False)
    write_upload(project, "arm.urdf", URDF, replace=False)
    other = URDF + b"<!-- newer -->"
    with refused("E-STUDIO-024", "arm.urdf"):
        write_upload(project, "arm.urdf", other, replace=False)
    assert contents(project) == {"project/arm.urdf": URDF}
    write_upload(project, "arm.urdf", other, replace=True)
    assert contents(project) == {"project/arm.urdf": other}


def test_meshes_go_where_the_urdf_looks_for_them(project: Project) -> None:
    write_upload(project, "r.urdf", MESHED, replace=False)
    assert {p.relative_to(project.folder).as_posix() for p in mesh_places(project)} == {
        "arm/meshes/base.stl",
        "arm/twice/x.obj",
        "arm/x.obj",
    }
    assert (
        write_upload(project, "base.stl", b"solid", replace=False) == project.folder / "arm/meshes/base.stl"
    )
    for name in ("x.obj", "outside.stl", "other.dae"):  # two places, outside the folder, none
        with refused("E-STUDIO-028", name):
            write_upload(project, name, b"solid", replace=False)
    assert set(contents(project)) == {"project/r.urdf", "project/arm/meshes/base.stl"}


def test_links_lead_no_upload_outside(project: Project) -> None:
    (project.folder.parent / "elsewhere").mkdir()
    write_upload(project, "r.urdf", MESHED, replace=False)
    (project.folder / "arm").symlink_to(project.folder.parent / "elsewhere")
    with refused("E-STUDIO-028"):
        write_upload(project, "base.stl", b"solid", replace=False)
    assert set(contents(project)) == {"project/r.urdf"}


def test_example_is_copied_whole_or_not_at_all(project: Project) -> None:
    example = next(e for e in examples_here() if e.title.startswith("UR5"))
    (project.folder / "grid.csv").write_text("mine")
    with refused("E-STUDIO-027", "grid.csv"):
        example.copy_to(project)
    assert contents(project) == {"project/grid.csv": b"mine"}
    (project.folder / "grid.csv").unlink()
    assert "robot.yaml" in example.copy_to(project)
    assert RobotModel.from_yaml(project.robot_file).n == 6
    assert not list(project.folder.glob("*.py"))


def test_no_example_is_offered_that_is_not_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import flexcal.jobs.inputs.experiment_files as files

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        files, "__file__", str(tmp_path / "lib/python3/site-packages/flexcal/jobs/inputs/x.py")
    )
    assert examples_here() == []
    shutil.copytree(EXAMPLES / "tx90l", tmp_path / "examples" / "tx90l")
    assert examples_here() == [
        Example("Stäubli TX90L, to be measured in the virtual cell", tmp_path / "examples" / "tx90l")
    ]


def test_robot_of_a_urdf_is_that_of_the_robot_yaml_made_for_it(project: Project) -> None:
    from flexcal.jobs.setup import init_robot

    path = project.folder / "ur5.urdf"
    shutil.copy(EXAMPLES / "ur5_tracker" / "ur5.urdf", path)
    bare = urdf_robot(path)
    assert [p.name for p in project.folder.iterdir()] == ["ur5.urdf"]
    made = init_robot(path, project.folder).model
    assert bare.motor_names == made.motor_names and bare.points == {}
    assert np.allclose([j.translation for j in bare.joints], [j.translation for j in made.joints])


def test_places_are_written_in_metres_and_comments_stay(project: Project) -> None:
    shutil.copytree(EXAMPLES / "tx90l", project.folder, dirs_exist_ok=True)
    before = project.robot_file.read_text()
    places = {p.title: p for p in places_of(RobotModel.from_yaml(project.robot_file))}
    assert places["measured point smr"].xyz == (100.0, 0.0, 150.0)
    assert places["payload"].mass == 6.0 and places["instrument tracker"].xyz == (2500.0, 0.0, 1000.0)
    saved = places["payload"]
    moved = Place("payload", "payload", "flange", (100.0, 12.5, -100.0), 5.5)
    assert saved.told_changes(moved) == "mass 6 → 5.5 kg, (100, 0, -100) → (100, 12.5, -100) mm"
    edit_robot(project.robot_file, saved.changes(moved))
    load = RobotModel.from_yaml(project.robot_file).config.payload
    assert load is not None and (load.mass, load.com, load.mass_std) == (5.5, (0.1, 0.0125, -0.1), 0.02)
    changed = [
        (a, b)
        for a, b in zip(before.splitlines(), project.robot_file.read_text().splitlines(), strict=True)
        if a != b
    ]
    assert len(changed) == 1 and changed[0][1].startswith("payload: {frame: flange, mass: 5.5")
    assert saved.changes(saved) == {} and saved.told_changes(saved) == ""


def test_sliders_have_the_limits_of_the_urdf() -> None:
    """Of a robot that turns and slides, against the file itself."""
    urdf = EXAMPLES / "panda_sockets" / "panda.urdf"
    limits = {
        joint.get("name"): (joint.get("type"), joint.find("limit"))
        for joint in ElementTree.parse(urdf).getroot().iter("joint")
    }
    model = RobotModel.from_yaml(urdf.with_name("robot.yaml"), estimates=False)
    for joint in model.motor_joints:
        kind, limit = limits[joint.name]
        assert limit is not None and kind == "revolute"
        given = [math.degrees(float(limit.get(key, "nan"))) for key in ("lower", "upper")]
        assert slider_range(joint) == pytest.approx(given, abs=0.005)
    assert slider_units(model) == "deg"
    slide = replace(model.motor_joints[0], kind="prismatic", lower=-0.25, upper=math.inf)
    assert slider_range(slide) == pytest.approx((-250.0, 1000.0))
    assert slider_range(replace(model.motor_joints[0], lower=-math.inf, upper=math.inf)) == (-180.0, 180.0)


def test_problems_stand_beside_their_lines_as_text(project: Project) -> None:
    shutil.copy(EXAMPLES / "servo_arm" / "arm.urdf", project.folder / "arm.urdf")
    project.robot_file.write_text(
        "robot: arm.urdf\npoints:\n  smr: {frame: '<b>x</b>', xyz: [0, 0, 0]}\n  # <script>alert(1)</script>\ngravitation: 3\n"
    )
    problems = description_problems(project.robot_file)
    html = problem_listing(problems, project.folder)
    assert [p.line for p in problems] == [5] and "robot.yaml, line 5" in html
    assert "▶   5  gravitation: 3" in html and "    4    # &lt;script&gt;" in html
    assert "<script" not in html and "<b>" not in html


TWO_ARMS = """<robot name="two"><link name="body"/>{}</robot>"""


def arm(side: str, joints: int = 6) -> str:
    """A chain of revolute joints on `body`, with links `<side>_1` to the last."""
    parts = []
    for k in range(1, joints + 1):
        parent = "body" if k == 1 else f"{side}_{k - 1}"
        parts.append(
            f'<link name="{side}_{k}"/><joint name="{side}_joint_{k}" type="revolute"><parent link="{parent}"/><child link="{side}_{k}"/>'
            '<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        )
    return "".join(parts)


def test_ends_of_several_arms_are_offered(project: Project) -> None:
    urdf = project.folder / "two.urdf"
    urdf.write_text(TWO_ARMS.format(arm("left") + arm("right")))
    assert arm_ends(urdf) == ["left_6", "right_6"]
    assert urdf_robot(urdf, "right_6").motor_names == tuple(f"right_joint_{k}" for k in range(1, 7))
    urdf.write_text(TWO_ARMS.format(arm("left")))
    assert arm_ends(urdf) == []
    urdf.write_text("<robot")
    assert arm_ends(urdf) == []


class SilentWindow:
    """What a `RobotFile` uses of a window."""

    def __init__(self, project: Project):
        self.project, self.said = project, []

    def say(self, text: str, tone: str) -> None:
        self.said.append(text)


def test_a_change_is_taken_back_unless_the_file_was_changed_since(project: Project) -> None:
    shutil.copytree(EXAMPLES / "ur5_tracker", project.folder, dirs_exist_ok=True)
    before = project.robot_file.read_bytes()
    window = SilentWindow(project)
    file = RobotFile(cast("Window", window))
    assert file.last_change is None
    file.edit({("points", "smr", "xyz"): [0.0, 0.0, 0.045]}, "smr moved")
    assert (
        project.robot_file.read_bytes() == before.replace(b"[0, 0, 0.031]", b"[0.0, 0.0, 0.045]")
        and file.last_change == "smr moved"
    )
    file.take_back()
    assert project.robot_file.read_bytes() == before and file.last_change is None
    file.edit({("points", "smr", "xyz"): [0.0, 0.0, 0.046]}, "smr moved")
    project.robot_file.write_bytes(before + b"# mine\n")
    assert file.last_change is None
    file.take_back()
    assert project.robot_file.read_bytes() == before + b"# mine\n"
    assert window.said == [
        "robot.yaml: smr moved.",
        "robot.yaml: taken back: smr moved.",
        "robot.yaml: smr moved.",
    ]
