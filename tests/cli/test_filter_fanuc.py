"""TP programs of a Fanuc are corrected: its true kinematics, and an interpreter of its programs, in the maker's convention."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from fanuc_arm import LrMate, moved, numbers_of, pose, true_arm, urdf_text
from program_cell import calibrate_cell, verified_error
from six_axis_arm import registered

from flexcal.cli.main import main

TOOL = np.array([10.0, -5.0, 120.0, 0.0, 20.0, 0.0])
FRAME = np.array([400.0, -100.0, -50.0, 0.0, 0.0, 30.0])
NOMINAL = LrMate()
HOME = np.array([5.0, 10.0, -15.0, 3.0, -60.0, 20.0])

_HEAD = """/PROG  WELD
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "M\xfcller /POS";
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/APPL
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=2 ;
   3:  PAYLOAD[1] ;
   4:  !Don't go to P[3] here ;
   5:J P[1:home] 100% FINE    ;
   6:J P[2] 50% CNT0 TB    .10sec,P-SPS    ;
      1:  TC_ONLINE (ON) ;
       ------ ;
"""
_END = """  90:J PR[3:safe] 100% FINE    ;
  91:L P[2] 100mm/sec FINE Offset,PR[7]    ;
  92:L P[1] 100mm/sec FINE Tool_Offset,PR[8:up]    ;
  93:  PR[9]=P[3] ;
  94:L P[R[4:next]] 100mm/sec FINE    ;
"""
_SYSFRAME = """[*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[1,9] OF POSITION
     [1,1] =\x20
  Group: 1   Config: N D B, 0, 0, 0
  X: {0:9.3f}   Y: {1:9.3f}   Z: {2:9.3f}
  W: {3:9.3f}   P: {4:9.3f}   R: {5:9.3f}
     [1,2] = Uninitialized
[*SYSTEM*]$MNUTOOL  Storage: SHADOW  Access: RW  : ARRAY[1,10] OF POSITION
     [1,2] =\x20
  Group: 1   Config: N D B, 0, 0, 0
  X: {6:9.3f}   Y: {7:9.3f}   Z: {8:9.3f}
  W: {9:9.3f}   P: {10:9.3f}   R: {11:9.3f}
"""


def cartesian(number: str, joints: np.ndarray, uf: int = 1, ut: int = 2) -> str:
    """A position as the controller of the nominal arm writes it, to three decimals."""
    at = np.linalg.inv(pose(FRAME)) @ NOMINAL.flange(joints) @ pose(TOOL)
    x, y, z, w, p, r = (
        f"{value:9.3f}".replace("-0.", " -.").replace(" 0.", "  .") for value in numbers_of(at)
    )
    return (
        f"P[{number}]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\tCONFIG : '{NOMINAL.config(joints)}, 0, 0, 0',\n"
        f"\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg\n"
        "   GP2:\n\tUF : 1, UT : 1,\t\n\tJ1=   100.000  mm\n};\n"
    )


def jointed(number: str, joints: np.ndarray) -> str:
    """Joint positions as a controller writes them."""
    values = [f"J{k}= {value:9.3f} deg" for k, value in enumerate(joints, 1)]
    rows = (",\t".join(row) for row in (values[:3], values[3:]))
    return f"P[{number}]{{\n   GP1:\n\tUF : 1, UT : 2,\t\n\t" + ",\n\t".join(rows) + "\n};\n"


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LrMate]:
    """A calibrated LR Mate, its program with CRLF, and the frames of its controller."""
    folder, arm = tmp_path_factory.mktemp("cell"), true_arm(4)
    (folder / "lrmate.urdf").write_text(urdf_text(), "utf-8")
    (folder / "robot.yaml").write_text(
        "robot: lrmate.urdf\npoints:\n  smr: {frame: tool0, xyz: [0.01, -0.005, 0.12]}\n", "utf-8"
    )
    rng = np.random.default_rng(11)
    for name, count in (("points", 90), ("others", 30)):
        rows = ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
        for k in range(count):
            joints = HOME + rng.uniform(-45, 45, 6)
            q = np.radians(joints)
            q[2] += q[1]
            at = (arm.flange(joints) @ pose(TOOL))[:3, 3] + rng.normal(0, 1.5e-5, 3) + [0, 0, 0.33]
            rows.append(",".join([str(k), *map(repr, q.tolist()), *map(repr, at.tolist())]))
        (folder / f"{name}.csv").write_text("\n".join(rows) + "\n", "utf-8")
    calibrate_cell(folder)
    stops = HOME + rng.uniform(-30, 30, (12, 6)) * [1, 1, 1, 1, 0.8, 1]
    lines, places = [], [jointed('1:"home"', HOME), cartesian("2", stops[0])]
    for k, joints in enumerate(stops[1:], 3):
        joints = joints * [1, 1, 1, 1, -1, 1] if k % 4 == 0 else joints
        letter = "L" if k % 4 in (2, 3) else "J"
        lines.append(f"  {k + 10}:{letter} P[{k}] 100{'%' if letter == 'J' else 'mm/sec'} FINE    ;\n")
        places.append(jointed(str(k), joints) if k % 5 == 0 else cartesian(str(k), joints))
    lines.append("  40:C P[3]    \n    :  P[6] 100mm/sec FINE    ;\n")
    text = _HEAD + "".join(lines) + _END + "/POS\n" + "".join(places) + "/END\n"
    (folder / "weld.ls").write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    (folder / "SYSFRAME.VA").write_bytes(_SYSFRAME.format(*FRAME, *TOOL).replace("\n", "\r\n").encode())
    return folder, arm


def filtered(folder: Path, *words: str) -> int:
    """Exit code of the verb."""
    return main(["filter", str(folder / "robot.yaml"), *words, "--estimates", str(folder / "out")])


def test_the_corrected_program_brings_the_true_tool_there(
    cell: tuple[Path, LrMate], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, arm = cell
    capsys.readouterr()
    sources = [str(folder / "weld.ls"), str(folder / "SYSFRAME.VA")]
    assert filtered(folder, *sources, "--out", str(folder / "new.ls"), "--json") == 0
    found = json.loads(capsys.readouterr().out)
    before, after = ((folder / name).read_bytes().decode("latin-1") for name in ("weld.ls", "new.ls"))
    tables = {0: np.eye(4), 2: pose(TOOL)}, {0: np.eye(4), 1: pose(FRAME)}
    wanted, now = (moved(text, NOMINAL, *tables, HOME) for text in (before, after))
    assert len(wanted) == 15 and len(found["targets"]) == 13
    missed = {item["name"]: item["between_mm"] for item in found["targets"] if item["between_mm"] is not None}
    assert missed.keys() == {"P[3]", "P[6]", "P[7]", "P[10]", "P[11]"}
    goals = np.array([(NOMINAL.flange(q) @ pose(TOOL))[:3, 3] for q in wanted])
    was, there = (np.array([(arm.flange(q) @ pose(TOOL))[:3, 3] for q in each]) for each in (wanted, now))
    verified = verified_error(folder, capsys)
    assert registered(was, goals).mean() > 2e-4 and registered(there, goals).mean() < 1.1 * verified < 4e-5
    number = r" *-?\d*\.\d+"
    assert re.sub(number, "#", before) == re.sub(number, "#", after), "only numbers change"
    assert before.count("\r\n") == after.count("\n") == before.count("\n")
    head, places = (text[: text.index("/POS\r")] for text in (before, after))
    assert head == places


def test_what_stays_is_named(cell: tuple[Path, LrMate], capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = cell
    capsys.readouterr()
    assert filtered(folder, str(folder / "weld.ls"), str(folder / "SYSFRAME.VA"), "--dry-run", "--json") == 0
    left = {item["text"]: item["reason"] for item in json.loads(capsys.readouterr().out)["left"]}
    assert left == {
        "J PR[3:safe] 100% FINE": "its position stands in a register of the controller",
        "L P[2] 100mm/sec FINE Offset,PR[7]": "the controller adds an offset to P[2], as corrected",
        "L P[1] 100mm/sec FINE Tool_Offset,PR[8:up]": "the controller adds an offset of the tool to P[1:home], as corrected",
        "PR[9]=P[3]": "it takes P[3], as corrected",
        "L P[R[4:next]] 100mm/sec FINE": "its position's number stands in a register of the controller",
    }


def test_reverse_returns_the_numbers(cell: tuple[Path, LrMate]) -> None:
    folder, _ = cell
    frames = str(folder / "SYSFRAME.VA")
    assert filtered(folder, str(folder / "weld.ls"), frames, "--out", str(folder / "there.ls")) == 0
    assert (
        filtered(folder, str(folder / "there.ls"), frames, "--reverse", "--out", str(folder / "back.ls")) == 0
    )
    first, there, back = (
        np.array([float(x) for x in re.findall(r"-?\d*\.\d+", (folder / name).read_text("latin-1"))])
        for name in ("weld.ls", "there.ls", "back.ls")
    )
    assert np.abs(back - first).max() < 1e-3 < np.abs(there - first).max(), "mm, and degrees"


_P = """P[1]{
 GP1:
 UF : 0, UT : 0, CONFIG : 'N U T, 0, 0, 0',
 X = 400.0 mm, Y = 20.0 mm, Z = 100.0 mm,
 W = 180.0 deg, P = 0.0 deg, R = 5.0 deg
};
"""


@pytest.mark.parametrize(
    ("motions", "places", "code", "said"),
    [
        ("1:J P[1] 9% FINE ;", _P, 0, "1 targets corrected"),
        ("1:J P[1] 9% FINE ;", _P.replace("N U T", "F U T"), 0, "1 targets corrected"),
        ("1:J P[1] 9% FINE ;", _P.replace("UT : 0", "UT : 4"), 0, "tool 4 is not in the program"),
        ("1:J P[1] 9% FINE ;", _P.replace("UF : 0", "UF : 3"), 0, "user frame 3, which is not in the program"),
        ("1:J P[1] 9% FINE ;", _P.replace("UT : 0", "UT : F"), 0, "no UTOOL_NUM before it"),
        ("1: UTOOL_NUM=0 ;\n2:J P[1] 9% FINE ;", _P.replace("UT : 0", "UT : F"), 0, "1 targets corrected"),
        ("1: UFRAME[5]=PR[2] ;\n2:J P[1] 9% FINE ;", _P.replace("UF : 0", "UF : 5"), 0, "sets UFRAME[5]"),
        ("1:J P[1] 9% FINE ;", _P.replace("400.0 mm", "******** mm"), 0, "its X is not recorded"),
        ("1:J P[1] 9% FINE ;", _P.replace("5.0 deg\n", "5.0 deg, E1= 12.5 mm\n"), 0, "external axis E1"),
        ("1:L P[1] 9mm/sec FINE INC ;", _P, 0, "an increment"),
        ("1:L P[2] 9mm/sec FINE ;", _P, 0, "P[2] is not in the program's positions"),
        ("1:J P[1] 9% FINE ;", _P.replace("400.0", "4000.0"), 0, "out of reach"),
        ("1:J P[1] 9% FINE ;", _P.replace("'N U T", "'N D B"), 0, "none of the"),
        ("1:J P[1] 9% FINE ;", _P.replace("};", "}"), 0, "1 targets corrected"),
        ("1:J P[1] 9% FINE ;", _P.replace("GP1:\n", ""), 2, "E-PROG-013"),
        ("1:J P[1] 9% FINE", _P, 2, "E-PROG-013"),
    ],
)  # fmt: skip
def test_frames_and_positions(
    cell: tuple[Path, LrMate],
    motions: str,
    places: str,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, _ = cell
    (folder / "odd.ls").write_text(f"/PROG ODD\n/MN\n{motions}\n/POS\n{places}/END\n", "utf-8")
    capsys.readouterr()
    assert filtered(folder, str(folder / "odd.ls"), "--dry-run") == code
    assert said in " ".join("".join(capsys.readouterr()).split())


def test_another_group_has_no_targets(cell: tuple[Path, LrMate], capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = cell
    text = f"/PROG ODD\n/ATTR\nDEFAULT_GROUP = *,1,*;\n/MN\n1:J P[1] 9% FINE ;\n/POS\n{_P}/END\n"
    (folder / "odd.ls").write_text(text, "utf-8")
    capsys.readouterr()
    assert filtered(folder, str(folder / "odd.ls"), "--dry-run") == 0
    assert "motion group 1" in "".join(capsys.readouterr())
    (folder / "odd.va").write_text("nothing", "utf-8")
    assert filtered(folder, str(folder / "weld.ls"), str(folder / "odd.va"), "--dry-run") == 2
    assert filtered(folder, str(folder / "odd.va"), "--dry-run") == 2
    assert "E-PROG-015" in "".join(capsys.readouterr())


def test_a_base_frame_elsewhere_is_told(
    cell: tuple[Path, LrMate], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = cell
    (folder / "low.urdf").write_text(
        urdf_text().replace('<child link="base"/><origin xyz="0 0 0.33"/>', '<child link="base"/>')
    )
    (folder / "low.yaml").write_text((folder / "robot.yaml").read_text().replace("lrmate.urdf", "low.urdf"))
    command = [
        "filter",
        str(folder / "low.yaml"),
        str(folder / "weld.ls"),
        str(folder / "SYSFRAME.VA"),
        "--dry-run",
    ]
    capsys.readouterr()
    assert main([*command, "--estimates", str(folder / "out")]) == 0
    assert "axis 2 lies 330.0 mm above it" in " ".join("".join(capsys.readouterr()).split())
