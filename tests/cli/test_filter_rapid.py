"""RAPID programs of an IRB 120 are corrected: a true arm that differs, and an interpreter of its programs by closed-form kinematics."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from program_cell import calibrate_cell, verified_error
from six_axis_arm import IRB120, Arm, frame, quaternion, registered, turned_by

from flexcal.cli.main import main

_TOOL = frame(turned_by(np.array([0.953717, 0.0, 0.300706, 0.0])), np.array([0.031, 0.0, 0.1]))
_FIXTURE = frame(turned_by(np.array([0.92388, 0.0, 0.0, 0.382683])), np.array([0.2, -0.1, 0.05])) @ frame(
    np.eye(3), np.array([0.01, 0.02, 0.0])
)
_NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
_PROGRAM = """%%%\r
  VERSION:1\r
  LANGUAGE:ENGLISH\r
%%%\r
MODULE Palette\r
  ! von Hand in K\xf6ln; "brackets [ in comments" and MoveL p10 do not count\r
  CONST string note:="[[1,2,3],[""quoted""; ! no comment";\r
  PERS tooldata tGripper := [TRUE,[[31,0,100],[0.953717,0,0.300706,0]],[1.5,[0,0,50],[1,0,0,0],0,0,0]];\r
  TASK PERS wobjdata wFixture:=[FALSE,TRUE,"",[[200,-100,50],[0.92388,0,0,0.382683]],[[10,20,0],[1,0,0,0]]];\r
  LOCAL CONST jointtarget jHome:=[[0, -10, 20.5,0,60,0],{none}];\r
{data}
  PROC main()\r
    MoveAbsJ jHome \\NoEOffs, v1000, fine, tGripper;\r
    IF note<>"x" THEN MOVEJ P1, v500,z50, TGRIPPER \\wobj:=WFIXTURE; ELSE Stop; ENDIF\r
{moves}
    MoveL {inline}, v100, fine, tGripper\\WObj:=wFixture;\r
    MoveL Offs(p1,0,0,50), v100, fine, tGripper\\WObj:=wFixture;\r
    MoveL pCamera, v100, fine, tGripper\\WObj:=wFixture;\r
    MoveJ *, v100, fine, tGripper;\r
  ENDPROC\r
ENDMODULE\r
"""


def quarters(q: np.ndarray, behind: bool, below: bool) -> list[int]:
    """Configuration data of a solution."""
    return [int(q[k] // 90) for k in (0, 3, 5)] + [4 * behind + 2 * below + (q[4] < 0)]


def robtarget(q: np.ndarray) -> str:
    """A robtarget in the fixture's frame at joint positions, degrees."""
    goal = IRB120.flange_at(q)
    at = np.linalg.inv(_FIXTURE) @ goal @ _TOOL
    exact = [s for s in IRB120.whole_turns(goal) if np.abs(s[0] - q).max() < 1e-6]
    assert len(exact) == 1
    _, behind, below = exact[0]
    numbers = (
        ",".join(f"{v * 1e3:.7f}" for v in at[:3, 3]),
        ",".join(f"{v:.10f}" for v in quaternion(at[:3, :3])),
    )
    return f"[[{numbers[0]}],[{numbers[1]}],[{','.join(map(str, quarters(q, behind, below)))}],{_NONE}]"


def moved(text: str) -> list[np.ndarray]:
    """Joint positions, degrees, of the motions of a program, run line by line."""
    known = {
        name.lower(): json.loads(f"[{body}]".replace("9E9", "9e9"))
        for name, body in re.findall(r"(?:robtarget|jointtarget) (\w+)\s*:=\s*\[(.*)\];", text)
    }
    stops = []
    for line in text.replace("\r", "").splitlines():
        line = line.split("!")[0]
        if line.strip().startswith("CONST") or not (call := re.search(r"Move(AbsJ|J|L) ([^;]*)", line, re.I)):
            continue
        first = call[2].strip()
        if first.startswith("[["):
            value = json.loads("[" + first[1 : first.index("]]") + 2].replace("9E9", "9e9"))
        elif (name := re.match(r"\w+|\*", first)) is None or name[0].lower() not in known:
            continue
        else:
            value = known[name[0].lower()]
        if len(value) == 2:
            stops.append(np.array(value[0]))
            continue
        position, turn, configuration, _ = value
        goal = _FIXTURE @ frame(turned_by(np.array(turn)), np.array(position) / 1e3) @ np.linalg.inv(_TOOL)
        fits = [s[0] for s in IRB120.whole_turns(goal) if quarters(*s) == configuration]
        assert len(fits) == 1, f"{first}: {len(fits)} solutions have the configuration {configuration}"
        stops.append(fits[0])
    return stops


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Arm]:
    """A calibrated IRB 120 and its program."""
    folder, arm = tmp_path_factory.mktemp("rapid"), IRB120.true_one(3)
    arm.measured(folder, _TOOL[:3, 3])
    calibrate_cell(folder)
    rng = np.random.default_rng(4)
    stops = IRB120.middle() + rng.uniform(-35, 35, (14, 6))
    stops[3, 4] = -50.0  # the wrist flipped
    stops[4, [0, 3, 5]] = 20.0, 140.0, 250.0  # quarter turns of the last axis beyond one turn
    stops[5] = [-100.0, -60.0, -40.0, 30.0, 70.0, -300.0]  # wrist centre behind axis 1
    stops[6] = [12.0, 60.0, -100.0, 5.0, 60.0, 3.0]
    stops[7, [0, 3]] = -0.001, 0.001  # next to the steps of cf1 and cf4
    data = "".join(f"  CONST robtarget p{k}:={robtarget(q)};\r\n" for k, q in enumerate(stops[:-1], 1))
    moves = "".join(
        f"    Move{'J' if k % 2 or k < 9 else 'L'} p{k},v100,z10,tGripper\\WObj:=wFixture; ! {k}\r\n"
        for k in range(2, len(stops))
    )
    program = _PROGRAM.format(none=_NONE, data=data[:-1], moves=moves[:-1], inline=robtarget(stops[-1]))
    (folder / "Palette.MOD").write_bytes(program.encode("latin-1"))
    return folder, arm


def filtered(folder: Path, source: str, out: str, *more: str) -> int:
    """Exit code of the verb."""
    options = ["--estimates", str(folder / "out"), "--out", str(folder / out), *more]
    return main(["filter", str(folder / "robot.yaml"), str(folder / source), *options])


def test_the_corrected_program_brings_the_true_tool_there(
    cell: tuple[Path, Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, arm = cell
    limit = verified_error(folder, capsys)
    assert filtered(folder, "Palette.MOD", "new.mod", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    before, after = ((folder / name).read_bytes().decode("latin-1") for name in ("Palette.MOD", "new.mod"))
    wanted, now = moved(before), moved(after)
    assert len(wanted) == len(now) == 15
    goals = np.array([(IRB120.flange_at(q) @ _TOOL)[:3, 3] for q in wanted])
    errors = [
        registered(np.array([(arm.flange_at(q) @ _TOOL)[:3, 3] for q in each]), goals)
        for each in (wanted, now)
    ]
    assert errors[0].mean() > 2e-4
    assert errors[1].mean() < 1.1 * limit < 3e-5
    number = r"-?\d*\.\d+|-?\d+"
    assert re.sub(number, "0", before) == re.sub(number, "0", after), "only numbers change"
    assert np.abs(np.array(wanted) - np.array(now)).max() < 1.0, "no configuration is left"
    told = {item["line"]: item["reason"] for item in found["left"]}
    assert len(told) == 3
    assert sum("from p1 as corrected" in reason for reason in told.values()) == 1
    assert sum("pCamera is not declared" in reason for reason in told.values()) == 1
    assert len(found["remarks"]) == 3
    for said, remark in zip(("axis 3", "1.5 kg", "between their points"), found["remarks"], strict=True):
        assert said in remark


def test_reverse_returns_the_numbers(cell: tuple[Path, Arm]) -> None:
    folder, _ = cell
    assert filtered(folder, "Palette.MOD", "there.mod") == 0
    assert filtered(folder, "there.mod", "back.mod", "--reverse") == 0
    first, there, back = (
        np.array([float(x) for x in re.findall(r"-?\d+\.?\d*", (folder / name).read_text("latin-1"))])
        for name in ("Palette.MOD", "there.mod", "back.mod")
    )
    # millimetres and quaternions: 1e-6 m
    assert np.abs(back - first).max() < 1e-4 < np.abs(there - first).max()
    configurations = [
        re.findall(r"\[-?\d+,-?\d+,-?\d+,\d+\]", (folder / name).read_text("latin-1"))
        for name in ("Palette.MOD", "back.mod")
    ]
    assert configurations[0] == configurations[1]


_POINT = f"CONST robtarget p1:=[[400,10,500],[0,0,1,0],[0,0,0,0],{_NONE}];\n"
_FLIPPED = f"CONST robtarget p2:=[[400,10,500],[0,0,1,0],[0,0,0,5],{_NONE}];\n"
_HOME = f"MoveAbsJ [[0,0,0,0,30,0],{_NONE}],v100,fine,tool0;\n"


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("MoveL [[1,2,3];\n", 2, "E-PROG-001"),
        (_POINT + "MoveL p1,v100,fine,tGun;\n", 0, "the tool tGun is not declared"),
        (_POINT + "MoveL p1,v100,fine,tool0\\WObj:=wTable;\n", 0, "wTable is not declared"),
        (
            _POINT
            + "PERS tooldata t:=[FALSE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];MoveL p1,v100,fine,t;",
            0,
            "which stands still",
        ),
        (
            _POINT
            + 'PERS wobjdata w:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];MoveL p1,v100,fine,tool0\\WObj:=w;',
            0,
            "a mechanical unit moves",
        ),
        (_POINT + "PDispOn p1,tool0;\nMoveL p1,v100,fine,tool0;\nPDispOff;\n", 0, "program displacement"),
        (_POINT + "PROC a()\np1.trans.z:=5;MoveL p1,v100,fine,tool0;\nENDPROC\n", 0, "set more than once"),
        ("PROC a(robtarget p1)\nMoveL p1,v100,fine,tool0;\nENDPROC\n", 0, "or a parameter"),
        (_POINT + "MyMove p1,v100;\n", 0, "no motion with plain arguments goes to it"),
        (_POINT + "MoveJ p1,v100,fine,tool0;\n", 0, "1 targets corrected"),
        (_POINT.replace("[0,0,0,0]", "[-1,0,0,0]") + "MoveJ p1,v100,fine,tool0;\n", 0, "1 targets corrected"),
        (
            _POINT.replace("[0,0,0,0]", "[2,0,0,0]") + "MoveJ p1,v100,fine,tool0;\n",
            0,
            "configuration (2, 0, 0, 0)",
        ),
        (
            f"{_POINT}{_POINT.replace('p1', 'p2').replace('400,', '410,')}CONST robtarget a{{2,1}}:=[[p1],[p2]];\n"
            "MoveL a{i,1},v100,fine,tool0;\n",
            0,
            "2 targets corrected",
        ),
        (
            _POINT + "CONST robtarget a{2}:=[p1,p9];\nMoveL a{i},v100,fine,tool0;\n",
            0,
            "not all elements of a are written",
        ),
        (_POINT + "CONST robtarget a{1}:=[p1];\nMoveL a{2},v100,fine,tool0;\n", 0, "or it has no such one"),
        (_FLIPPED + "MoveJ p2,v100,fine,tool0;\n", 0, "has the configuration (0, 0, 0, 5)"),
        (_POINT + "ConfJ\\Off;\nMoveJ p1,v100,fine,tool0;\n", 0, "--start"),
        (_POINT + _HOME + "ConfJ \\Off;\nMoveJ p1,v100,fine,tool0;\n", 0, "2 targets corrected"),
        (
            f"CONST robtarget a{{2}}:=[[[400,10,500],[0,0,1,0],[0,0,0,0],{_NONE}],[[400,20,500],[0,0,1,0],[0,0,0,0],{_NONE}]];\n"
            "FOR i FROM 1 TO 2 DO\nMoveL a{i},v100,fine,tool0;\nENDFOR\n",
            0,
            "2 targets corrected",
        ),
        (
            "SearchL di1,found,[[400,10,500],[0,0,1,0],[0,0,0,0],[100,9E9,9E9,9E9,9E9,9E9]],v100,tool0;",
            0,
            "external axes",
        ),
        ('TPWrite "nothing";\n', 2, "has no motion in RAPID of ABB"),
    ],
)
def test_what_stays_is_said(
    cell: tuple[Path, Arm],
    tmp_path: Path,
    text: str,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, _ = cell
    (folder / "odd.mod").write_text(text, "utf-8")
    capsys.readouterr()
    assert filtered(folder, "odd.mod", "odd_new.mod") == code
    told = " ".join("".join(capsys.readouterr()).split())
    assert said in told


def test_tools_of_another_module(cell: tuple[Path, Arm], capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = cell
    whole = (folder / "Palette.MOD").read_bytes().decode("latin-1")
    lines = whole.splitlines(keepends=True)
    frames = [line for line in lines if "tooldata" in line or "wobjdata" in line]
    (folder / "Points.mod").write_bytes(
        "".join(line for line in lines if line not in frames).encode("latin-1")
    )
    (folder / "Frames.sys").write_bytes(
        "".join(["MODULE Frames(SYSMODULE)\r\n", *frames, "ENDMODULE\r\n"]).encode()
    )
    both = [str(folder / "robot.yaml"), str(folder / "Points.mod"), str(folder / "Frames.sys"), "--estimates"]
    assert main(["filter", *both, str(folder / "out"), "--out", str(folder / "new")]) == 0
    assert filtered(folder, "Palette.MOD", "new.mod") == 0
    assert (folder / "new" / "Frames.sys").read_bytes() == (folder / "Frames.sys").read_bytes()
    one, two = ((folder / name).read_text("latin-1") for name in ("new.mod", "new/Points.mod"))
    assert re.findall(r"CONST.*", one) == re.findall(r"CONST.*", two)
    capsys.readouterr()
    assert main(["filter", *both, str(folder / "out"), "--out", str(folder / "both.mod")]) == 2
    assert "E-PROG-008" in capsys.readouterr().err
    assert main(["filter", *both, str(folder / "out"), "--out", str(folder)]) == 2
    assert "E-CLI-013" in capsys.readouterr().err


def test_a_urdf_that_counts_otherwise_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same arm whose URDF has the second joint's zero level and the fourth joint reversed."""
    odd = replace(IRB120, signs=(1, 1, 1, -1, 1, 1), zeros=(0, -90, 0, 0, 0, 0), limits=((-190, 190),) * 6)
    odd.true_one(3).measured(tmp_path, _TOOL[:3, 3])
    (tmp_path / "p.mod").write_text(
        _POINT + _FLIPPED + "MoveJ p1,v100,fine,tool0;\nMoveJ p2,v100,fine,tool0;\n"
    )
    calibrated = [
        "calibrate",
        str(tmp_path / "robot.yaml"),
        str(tmp_path / "points.csv"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(calibrated) == 0
    capsys.readouterr()
    assert filtered(tmp_path, "p.mod", "q.mod") == 0
    assert "its arm at zero is not that of RAPID of ABB: joint 4 turns about" in " ".join(
        capsys.readouterr().out.split()
    )
    told = ["--joint-signs", "1", "1", "1", "-1", "1", "1", "--joint-zeros", "0", "-90", "0", "0", "0", "0"]
    assert filtered(tmp_path, "p.mod", "q.mod", *told, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["targets"]) == 1 and not found["remarks"]
    assert found["targets"][0]["shift_mm"] < 3
