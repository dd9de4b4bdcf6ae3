"""Files that a xacro description reads: of its packages, regular, of bounded size; a plain URDF is never expanded."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from xacro_robots import CONTROLLED, XMLNS, expanded, write_files

from flexcal.export import XacroSource, render_xacro
from flexcal.export.xacro_files import MOST_BYTES
from flexcal.model.robot import RobotModel

xacro = pytest.importorskip("xacro")

OTHER = f'<robot {XMLNS}><xacro:property name="a" value="1"/></robot>'


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with a link out of it, and what lies outside."""
    folder = tmp_path / "here" / "arm"
    write_files(folder, {"package.xml": "<package><name>arm</name></package>", "urdf/part.xacro": OTHER})
    write_files(tmp_path / "there", {"secret.yaml": "a: 1", "part.xacro": OTHER, "package.xml": "<package/>"})
    (folder / "link.yaml").symlink_to(tmp_path / "there" / "secret.yaml")
    (folder / "away").symlink_to(tmp_path / "there")
    (tmp_path / "here" / "linked").symlink_to(tmp_path / "there")
    os.mkfifo(folder / "pipe.xacro")
    with (folder / "sparse.yaml").open("wb") as stream:
        stream.truncate(10 * MOST_BYTES)
    return folder


def main_file(package: Path, body: str) -> XacroSource:
    path = package / "urdf" / "arm.xacro"
    path.write_text(f'<robot name="arm" {XMLNS}>{body}</robot>')
    return XacroSource(path, {"HOME": "given"}, {})


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ('<xacro:include filename="{tmp}/there/part.xacro"/>', "E-ROS-034"),
        ('<xacro:include filename="../../../there/part.xacro"/>', "E-ROS-034"),
        ('<xacro:include filename="../away/part.xacro"/>', "E-ROS-034"),
        ('<xacro:include filename="../away/*.xacro"/>', "E-ROS-034"),
        ('<xacro:include filename="/*/*.xacro"/>', "E-ROS-037"),
        ('<xacro:include filename="/dev/zero"/>', "E-ROS-034"),
        ('<xacro:include filename="../pipe.xacro"/>', "E-FILE-014"),
        ('<xacro:include filename="absent.xacro"/>', "E-ROS-004"),
        ("<a b=\"${xacro.load_yaml('/etc/passwd')}\"/>", "E-ROS-034"),
        ("<a b=\"${xacro.load_yaml('../link.yaml')}\"/>", "E-ROS-034"),
        ("<a b=\"${xacro.load_yaml('../sparse.yaml')}\"/>", "E-FILE-020"),
        ('<xacro:include filename="$(find linked)/part.xacro"/>', "E-ROS-005"),
        ('<xacro:include filename="$(find ../there)/part.xacro"/>', "E-ROS-005"),
        ('<a><xacro:attribute name="b" value="${1}"/></a>', "E-ROS-004"),
        ('<xacro:element xacro:name="${1}"/>', "E-ROS-004"),
        ("<!-- xacro:eval-comments --><!-- ${'-' * 3} -->", "E-ROS-004"),
        ('<a b="$(env PATH)"/>', "E-ROS-037"),
        ('<a b="$(eval 1 + 1)"/>', "E-ROS-037"),
        ('<a b="$(anon a)"/>', "E-ROS-037"),
        ('<a b="$(dirname)"/>', "E-ROS-037"),
    ],
)
def test_nothing_else_is_read(package: Path, tmp_path: Path, body: str, code: str) -> None:
    with refused(code):
        main_file(package, body.replace("{tmp}", str(tmp_path))).expand({})
    for name in ("eval", "open"):
        assert not hasattr(xacro, name)


def test_own_files_and_given_values_are(package: Path, tmp_path: Path) -> None:
    body = '<xacro:include filename="p*.xacro"/><a b="${a} $(env HOME) $(optenv PATH none at all)"/>'
    assert 'b="1 given none at all"' in main_file(package, body).expand({}).text
    away = main_file(package, '<xacro:include filename="../away/part.xacro"/>')
    named = XacroSource(away.path, {}, {"there": tmp_path / "there"})
    assert tmp_path / "there" / "part.xacro" not in named.expand({}).contents  # read where the link stands
    assert package / "away" / "part.xacro" in named.expand({}).contents


def test_what_all_files_have_is_bounded(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flexcal.export.xacro_files.MOST_BYTES", 300)
    with refused("E-ROS-033", "part.xacro"):
        main_file(package, f'<!--{"x" * 100}--><xacro:include filename="part.xacro"/>').expand({})


def test_a_urdf_that_declares_xacro_is_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_files(tmp_path, {"arm.xacro": CONTROLLED})
    text = expanded(tmp_path / "arm.xacro").replace('name="servo"', f'name="servo" {XMLNS}')
    text = text.replace("bus/Servos", "${xacro.load_yaml('/etc/passwd')}")
    write_files(
        tmp_path,
        {
            "arm.urdf": text,
            "robot.yaml": "robot: arm.urdf\npoints:\n  tip: {frame: slide_link, xyz: [0.1, 0, 0]}\n",
        },
    )
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    monkeypatch.setitem(sys.modules, "xacro", None)
    export = render_xacro(model, model, XacroSource(tmp_path / "arm.urdf", {}, {}), "origins")
    assert list(export.description.contents.values()) == [text.encode()]


@pytest.mark.parametrize(
    ("right", "wrong", "refusal"),
    [
        ('xyz="${reach} 0 0"', 'xyz="=1+1 %s%n 0"', ["E-URDF-028", "arm.xacro", "17", "xyz", "slide"]),
        ('upper="1.2"', 'upper="nan"', ["E-URDF-028", "line 12", "upper", "lift"]),
        (
            'soft_upper_limit="1.1"',
            'soft_upper_limit="x"',
            ["E-URDF-028", "line 13", "lift"],
        ),
        ('k_velocity="10"', 'k_velocity="x"', ["E-ROS-042", "arm.xacro"]),
        (
            '<joint name="slide" type="prismatic">',
            '<joint name="slide" type="fixed">',
            ["E-ROS-041", "slide", "fixed"],
        ),
        ('<link name="slide_link"/>', "", ["E-URDF-016", "line 17", "slide_link"]),
    ],
)
def test_numbers_and_structure_are_checked_where_they_are_written(
    tmp_path: Path, right: str, wrong: str, refusal: list[str]
) -> None:
    write_files(tmp_path, {"arm.xacro": CONTROLLED})
    yaml = "robot: arm.urdf\npoints:\n  tip: {frame: slide_link, xyz: [0.1, 0, 0]}\n"
    write_files(tmp_path, {"arm.urdf": expanded(tmp_path / "arm.xacro"), "robot.yaml": yaml})
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    assert CONTROLLED.count(right) == 1
    (tmp_path / "arm.xacro").write_text(CONTROLLED.replace(right, wrong))
    calibrated = model.with_values({"pan.offset": 0.01, "lift.offset": 0.01})
    with refused(*refusal):
        export = render_xacro(calibrated, model, XacroSource(tmp_path / "arm.xacro", {}, {}), "ros2_control")
        export.tool(np.zeros((1, model.n)))
