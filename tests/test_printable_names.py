"""Names and texts from files: what no name may hold is refused where it is read, commands are quoted, foreign files are not shown."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from flexcal.errors import InputError
from flexcal.files.formats import read_yaml
from flexcal.model.robot import RobotConfig, RobotModel
from flexcal.printable import excerpt, quoted

URDF = """<robot name="arm"><link name="base"/><link name="tip"/>
<joint name="{joint}" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize("character", ["\x1b", "\x85", "\u2028", "\n", "\x9b", "\u202e"])
def test_names_with_control_characters_are_refused(character: str, tmp_path: Path) -> None:
    shown = ascii(character)[1:-1]
    robot = tmp_path / "robot.yaml"
    robot.write_text("robot: arm.urdf\n")
    (tmp_path / "arm.urdf").write_text(URDF.format(joint=f"a&#{ord(character)};b"), "utf-8")
    if character != "\x1b":  # which no XML may have
        with pytest.raises(InputError, match=r"arm\.urdf line 2: the name 'a.*b' of a <joint>") as caught:
            RobotModel.from_yaml(robot)
        assert f"the character {shown}," in str(caught.value)
    (tmp_path / "arm.urdf").write_text(URDF.format(joint="j"), "utf-8")
    for key, entry in (("points", "{frame: tip, xyz: [0, 0, 0]}"), ("stations", "{xyz: [0, 0, 0]}")):
        robot.write_text(f'robot: arm.urdf\n{key}: {{"a\\u{ord(character):04x}b": {entry}}}\n')
        with pytest.raises(InputError, match=r"robot\.yaml line 2: " + key) as caught:
            RobotModel.from_yaml(robot)
        assert f"the character {shown}," in str(caught.value)


@pytest.mark.parametrize("content", ["root:x:0:0:secret", "hunter2", "123456", "lines that are\nsecret"])
def test_a_file_that_is_no_mapping_is_not_shown(content: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(content + "\n")
    with pytest.raises(InputError, match=r"a mapping .* is expected, not a single value") as caught:
        read_yaml(tmp_path / "robot.yaml", RobotConfig)
    assert content.split()[-1] not in str(caught.value)


def test_paths_in_commands_are_one_word() -> None:
    for path in ("my robot.yaml", "a'b", "$(reboot).yaml", "-x.csv", "a;b", "robot.yaml"):
        (word,) = shlex.split(quoted(path))
        assert Path(word) == Path(path) and not word.startswith("-")
    assert quoted(Path("robot.yaml")) == "robot.yaml"


def test_excerpts_are_short_and_printable() -> None:
    assert excerpt("a\x1b[31m\nb") == "a\\x1b[31m b"
    assert len(excerpt("x" * 10**6)) == 40 and excerpt("x" * 40) == "x" * 40
