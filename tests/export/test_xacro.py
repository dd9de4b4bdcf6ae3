"""Calibrated numbers in xacro files: expanded by xacro itself, against forward kinematics of the test's own."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from xacro_robots import (
    ARITHMETIC,
    ARM_MACRO,
    ONE_ARM,
    THIRD_BY_MACRO,
    THIRD_WRITTEN,
    TWO_ARMS,
    UR_KINEMATICS,
    UR_LIKE,
    expanded,
    link_poses,
    write_files,
)

from flexcal.export import XacroSource, Zeros, measure_export_error, render_xacro
from flexcal.export.xacro_robot import XacroExport
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

pytest.importorskip("xacro")

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
PACKAGE = {"package.xml": "<package><name>my_arms</name></package>"}
ONE = {"robots/one.xacro": ONE_ARM, **PACKAGE, "parts/arm.xacro": ARM_MACRO % THIRD_BY_MACRO}
TWO = {
    "robots/two.xacro": TWO_ARMS.replace("$(find my_arms)", ".."),
    "parts/arm.xacro": ARM_MACRO % THIRD_WRITTEN,
    **PACKAGE,
}
SIX = {"six.urdf.xacro": UR_LIKE, "config/default_kinematics.yaml": UR_KINEMATICS}
BENCH = {"bench.urdf.xacro": ARITHMETIC}
ROBOTS = {
    "properties": (BENCH, "hand_link"),
    "nested macro": (ONE, "link3"),
    "two arms": (TWO, "left_link3"),
    "kinematics YAML": (SIX, "wrist_3_link"),
}


@dataclass
class Case:
    """A description in a folder, and the robot of the URDF that xacro makes of it."""

    folder: Path
    source: XacroSource
    model: RobotModel

    def export(self, wrong: RobotModel, zeros: Zeros = "origins") -> XacroExport:
        return render_xacro(wrong, self.model, self.source, zeros)

    def write(self, export: XacroExport, folder: Path) -> Path:
        """Write all files somewhere else; returns the main one."""
        for path, content in export.description.contents.items():
            place = folder / path.relative_to(self.folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
        return folder / self.source.path.relative_to(self.folder)


@pytest.fixture
def described(tmp_path: Path) -> Callable[..., Case]:
    def make(files: dict[str, str], link: str, *arguments: str) -> Case:
        folder = tmp_path / "description"
        write_files(folder, files)
        main = folder / next(iter(files))
        (tmp_path / "robot.urdf").write_text(expanded(main, *arguments))
        (tmp_path / "robot.yaml").write_text(
            f"robot: robot.urdf\npoints:\n  tip: {{frame: {link}, xyz: [0.03, 0.02, 0.1]}}\n"
        )
        source = XacroSource(main, dict(text.split(":=") for text in arguments), {})
        return Case(folder, source, RobotModel.from_yaml(tmp_path / "robot.yaml"))

    return make


def assert_same_kinematics(model: RobotModel, urdf: str, shift: np.ndarray | float = 0.0) -> None:
    """Every point of the model, by the URDF and the places of the points in their links."""
    from flexcal.model.kinematics import point_placement

    for name in model.points:
        carrier, position, rotation = point_placement(model, name)
        for q in np.random.default_rng(1).uniform(-2, 2, (20, model.n)):
            ours = point_kinematics(model, q[None], point=name, jacobians=False)
            at = link_poses(urdf, dict(zip(model.joint_names, q + shift, strict=True)))[
                model.joints[carrier].link
            ]
            np.testing.assert_allclose(at[:3, :3] @ position + at[:3, 3], ours.position[0], atol=1e-9)
            np.testing.assert_allclose(at[:3, :3] @ rotation, ours.orientation[0], atol=1e-9)


@pytest.mark.parametrize("kind", ROBOTS)
def test_forward_kinematics_by_xacro_itself(described, erroneous, tmp_path: Path, kind: str) -> None:
    case = described(*ROBOTS[kind])
    wrong = erroneous(case.model, 1e-2)
    export = case.export(wrong)
    assert_same_kinematics(wrong, expanded(case.write(export, tmp_path / "new")))
    error = measure_export_error(wrong, export.tool, ()).error
    assert error is not None and error.max < 1e-9


def without_numbers(content: bytes) -> bytes:
    """Content without origins, without the line that reads the overlay, and without numbers of properties and YAML."""
    content = re.sub(rb"\s*<origin[^>]*/>", b"", content)
    content = re.sub(rb"\n[^\n]*load_yaml\('[^\n]*calibration.yaml'[^\n]*", b"", content)
    lines = content.split(b"\n")
    return b"\n".join(
        NUMBER.sub(b"#", line) if b"<" not in line or b"property" in line else line for line in lines
    )


@pytest.mark.parametrize("kind", ROBOTS)
def test_every_other_byte_stays(described, erroneous, kind: str) -> None:
    case = described(*ROBOTS[kind])
    export = case.export(erroneous(case.model, 1e-2))
    for name, text in ROBOTS[kind][0].items():
        if name in PACKAGE:
            continue
        after = export.description.contents[case.folder / name]
        if case.folder / name in export.description.changes:
            assert after != text.encode() and without_numbers(after) == without_numbers(text.encode())
        else:
            assert after == text.encode()


def test_only_the_numbers_of_one_joint_change(described) -> None:
    """A zero of one joint: five numbers are other ones, and nothing else in any file."""
    case = described(*ROBOTS["kinematics YAML"])
    export = case.export(case.model.with_values({"elbow_joint.offset": 0.01}))
    (path,) = export.description.changes
    assert path.name == "default_kinematics.yaml"
    assert export.description.contents[path] == UR_KINEMATICS.encode().replace(
        b"    yaw: 0\n  wrist_1", b"    yaw: 0.01\n  wrist_1"
    )
    assert export.description.changes[path] == ("line 17: kinematics.forearm.yaw, for rpy of elbow_joint",)


def test_where_numbers_go(described, erroneous) -> None:
    """A property that one joint alone has, the literal numbers beside it, and the overlay for one that the flange has too."""
    case = described(*ROBOTS["properties"])
    changes = {
        path.name: said for path, said in case.export(erroneous(case.model)).description.changes.items()
    }
    assert "line 6: upper, for xyz of bend" in changes["bench.urdf.xacro"]
    assert "line 28: <origin> added to lift" in changes["bench.urdf.xacro"]
    assert "line 38: xyz of roll comes from bench.calibration.yaml" in changes["bench.urdf.xacro"]
    assert not any("mm" in said.split() for said in changes["bench.urdf.xacro"])
    assert list(changes) == ["bench.urdf.xacro", "bench.calibration.yaml"]


def test_two_arms_of_one_macro_have_their_own_numbers(described, tmp_path: Path) -> None:
    case = described(*ROBOTS["two arms"])
    wrong = case.model.with_values({"left_joint3.offset": 0.02})
    export = case.export(wrong)
    overlay = export.description.contents[case.folder / "robots" / "two.calibration.yaml"].decode()
    assert '"left_joint3"' in overlay and '"right_joint3"' in overlay and "joint2" not in overlay
    poses = link_poses(expanded(case.write(export, tmp_path / "new")), {})
    before = link_poses(expanded(case.source.path), {})
    assert np.array_equal(poses["right_link3"], before["right_link3"])
    assert not np.allclose(poses["left_link3"], before["left_link3"], atol=1e-3)


def test_an_origin_that_two_joints_share_outside_of_them_is_refused(described) -> None:
    case = described({**TWO, "parts/arm.xacro": ARM_MACRO % THIRD_BY_MACRO}, "left_link3")
    with refused("E-ROS-009", "arm.xacro", "left_joint3", "right_joint3"):
        case.export(case.model.with_values({"left_joint3.offset": 0.02}))


def test_packages_and_arguments(tmp_path: Path, described, erroneous) -> None:
    """A package is found by its package.xml above the file; arguments change names and files."""
    files = {"robots/two.xacro": TWO_ARMS, "parts/arm.xacro": TWO["parts/arm.xacro"]}
    folder = tmp_path / "somewhere"
    write_files(folder, {**files, **PACKAGE})
    found = XacroSource(folder / "robots" / "two.xacro", {}, {}).expand({})
    assert folder in found.packages and folder / "parts" / "arm.xacro" in found.sources
    (folder / "package.xml").unlink()
    with refused("E-ROS-005", "two.xacro", "my_arms"):
        XacroSource(folder / "robots" / "two.xacro", {}, {}).expand({})
    XacroSource(folder / "robots" / "two.xacro", {}, {"my_arms": folder}).expand({})
    write_files(tmp_path / "description", {"config/own.yaml": UR_KINEMATICS.replace("-0.425", "-0.4")})
    case = described(SIX, "a_wrist_3_link", "tf_prefix:=a_", "kinematics:=config/own.yaml")
    changes = case.export(erroneous(case.model)).description.changes
    assert [path.name for path in changes] == ["own.yaml"]


def test_a_urdf_needs_no_xacro(tx90l: RobotModel, erroneous, tmp_path: Path) -> None:
    """Line ends and all text outside of origins stay."""
    content = tx90l.urdf.read_bytes().replace(b"\n", b"\r\n")
    (tmp_path / "arm.urdf").write_bytes(content)
    wrong = erroneous(tx90l)
    export = render_xacro(wrong, tx90l, XacroSource(tmp_path / "arm.urdf", {}, {}), "origins")
    (after,) = export.description.contents.values()
    strip = re.compile(rb"\s*<origin[^>]*/>")
    assert strip.sub(b"", after) == strip.sub(b"", content)
    assert_same_kinematics(wrong, after.decode())


def test_inertials_change_where_they_are_written(tx90l: RobotModel, tmp_path: Path) -> None:
    link = tx90l.joints[2].link
    heavy = tx90l.with_values({f"{link}.mass": tx90l.value(f"{link}.mass") + 1.5})
    export = render_xacro(heavy, tx90l, XacroSource(tx90l.urdf, {}, {}), "origins")
    (content,) = export.description.contents.values()
    (tmp_path / "new.urdf").write_bytes(content)
    from flexcal.model.urdf import read_urdf

    read = read_urdf(tmp_path / "new.urdf", {})
    for new, wanted in zip(read.inertias, heavy.inertias, strict=True):
        np.testing.assert_allclose(new.mass, wanted.mass, rtol=1e-12)
        np.testing.assert_allclose(new.com, wanted.com, atol=1e-12)
        np.testing.assert_allclose(new.inertia, wanted.inertia, atol=1e-12)
    assert (
        sum(a != b for a, b in zip(content.split(b"\n"), tx90l.urdf.read_bytes().split(b"\n"), strict=True))
        <= 3
    )


def test_bad_files_are_named(described, tmp_path: Path) -> None:
    case = described(*ROBOTS["properties"])
    path = case.source.path
    path.write_text(ARITHMETIC.replace('<link name="base"/>', '<link name="base">'))
    with refused("E-ROS-001", "bench.urdf.xacro", "line"):
        case.export(case.model)
    path.write_text(ARITHMETIC.replace("${column}", "${colum}"))
    with refused("E-ROS-037", "bench.urdf.xacro", "24", "colum"):
        case.export(case.model)
    path.write_text(ARITHMETIC.replace('"0.42"', '"0.43"'))
    with refused("E-ROS-013", "bench.urdf.xacro", "turn", "robot.urdf"):
        case.export(case.model)
    path.write_text(ARITHMETIC.replace('name="turn"', 'name="yaw"'))
    with refused("E-ROS-012", "bench.urdf.xacro", "turn", "robot.urdf"):
        case.export(case.model)
    path.write_bytes(ARITHMETIC.encode().replace(b"floor", b"flo\xf6r"))
    with refused("E-ROS-002", "bench.urdf.xacro", "5"):
        case.export(case.model)
    path.unlink()
    with refused("E-FILE-001", "bench.urdf.xacro"):
        case.export(case.model)


def test_macros_need_xacro_and_say_so(described, monkeypatch: pytest.MonkeyPatch) -> None:
    case = described(*ROBOTS["properties"])
    monkeypatch.setitem(sys.modules, "xacro", None)
    with refused("E-ROS-003", "bench.urdf.xacro", "pip install xacro"):
        case.export(case.model)


def test_a_description_that_numbers_cannot_follow_is_left(described) -> None:
    """A zero that switches something when it is another number; a joint that xacro:element makes."""
    made = ARITHMETIC.replace(
        '<joint name="bend" type="revolute">',
        '<xacro:element xacro:name="joint" name="bend" type="revolute">',
    )
    begin = made.index('name="bend"')
    end = made.index("</joint>", begin)
    made = made[:end] + "</xacro:element>" + made[end + len("</joint>") :]
    made = made.replace('<origin xyz="${reach} 0 0"/>', "")
    case = described({"bench.urdf.xacro": made}, "hand_link")
    with refused("E-ROS-007", "bench.urdf.xacro", "bend"):
        case.export(case.model.with_values({"bend.offset": 0.1}))
