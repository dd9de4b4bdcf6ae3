"""Robot programs with numbers that cannot be, and broken motions: what cannot be corrected is left with its reason, or refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexcal.errors import InputError
from flexcal.jobs.deployment import read_program

_FANUC = (
    "/PROG A\n/MN\n   1:{motion} ;\n/POS\nP[1]{{\n   GP1:\n\tUF : {frame}, UT : 1,\n\t{numbers}\n}};\n/END\n"
)
_JOINTS = ",\t".join(f"J{k} = 1.0 deg" for k in range(1, 7))


def fanuc(motion: str = "J P[1] 100% FINE", frame: str = "1", numbers: str = _JOINTS) -> str:
    return _FANUC.format(motion=motion, frame=frame, numbers=numbers)


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.script", "set_tcp(p[0,0,0,0,0,0])\nmovel(p[1e300,0,0,0,0,0])", "more than 1000 m away"),
        ("a.script", "set_tcp(p[0,0,0,0,0,0])\nmovel(p[9999,0,0,0,0,0])", "more than 1000 m away"),
        ("a.script", "movej([1e9,0,0,0,0,0])", "a number beyond 1e+06"),
        ("a.script", "set_payload(1e9)\nmovej([0,0,0,0,0,0])", "payload is more than 10000 kg"),
        (
            "a.src",
            "DEF a()\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {X 1e308,Y 0,Z 0,A 0,B 0,C 0}\nEND",
            "more than 1000 m away",
        ),
        (
            "a.mod",
            "MoveL [[0,0,0],[0,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;",
            "its orientation is no quaternion",
        ),
        ("a.ls", fanuc(motion="L P00mm/sec FINE"), "its position cannot be read"),
        ("a.ls", fanuc(numbers=_JOINTS.replace("1.0", "9" * 400)), "a number beyond 1e+06"),
    ],
)
def test_a_target_that_cannot_be_is_left(name: str, text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    program = read_program(tmp_path / name)
    assert not program.targets
    assert [reason in item.reason for item in program.computed] == [True]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "a.script",
            "set_tcp(p[1e300,0,0,0,0,0])\nmovel(p[0,0,0,0,0,0])",
            "the pose [1e+300, 0, 0, 0, 0, 0]",
        ),
        ("a.script", "movej(" + "(" * 20_000 + ")" * 20_001, "line 1: more than 100 brackets"),
        (
            "a.src",
            "DEF a()\n$BASE={X 1e300,Y 0,Z 0,A 0,B 0,C 0}\nPTP {X 1,Y 0,Z 0,A 0,B 0,C 0}\nEND",
            "the pose",
        ),
        ("a.ls", fanuc(motion=f"J P[{'9' * 5000}] 100% FINE"), "the number 99999999999999999999 is none"),
        ("a.ls", fanuc(frame="9" * 400), "the number 99999999999999999999 is none"),
    ],
)
def test_a_frame_or_name_that_cannot_be_is_refused(name: str, text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=name) as caught:
        read_program(tmp_path / name)
    assert said in str(caught.value) and len(str(caught.value)) < 500
