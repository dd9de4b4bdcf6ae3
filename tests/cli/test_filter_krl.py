"""KRL programs of a KR 6 R900 are corrected: a true arm that differs, and an interpreter of its programs by closed-form kinematics."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from program_cell import calibrate_cell, verified_error
from six_axis_arm import KR6, Arm, frame, registered, turn

from flexcal.cli.main import main
from flexcal.programs.krl_configuration import StatusAndTurn


def posed(x: float, y: float, z: float, a: float, b: float, c: float) -> np.ndarray:
    """Matrix of X, Y, Z in mm and A, B, C in degrees."""
    turns = turn("z", np.deg2rad(a)) @ turn("y", np.deg2rad(b)) @ turn("x", np.deg2rad(c))
    return frame(turns, np.array([x, y, z]) / 1e3)


_TOOL, _BASE = posed(31, 0, 100, 0, 30, 0), posed(200, -100, 50, 45, 0, 0)
_CONFIG = """DEFDAT $CONFIG PUBLIC
DECL FRAME TOOL_DATA[16]
TOOL_DATA[1]={X 31.0,Y 0.0,Z 100.0,A 0.0,B 30.0,C 0.0}
TOOL_DATA[2]={x 0,y 0,z 50,a 0,b 0,c 0}
LOAD_DATA[1]={M 2.5,CM {X 0.0,Y 0.0,Z 50.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}
BASE_DATA[3]={FRAME: X 200.0,Y -100.0,Z 50.0,A 45.0,B 0.0,C 0.0}
DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 20.0,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
ENDDAT
"""
_DATA = """&ACCESS RVP\r
&COMMENT it's made by hand in K\xf6ln\r
DEFDAT  PICK PUBLIC\r
EXT  BAS (BAS_COMMAND  :IN,REAL  :IN )\r
DECL CHAR NOTE[20]\r
NOTE[]="a {X 1, ; no ("\r
{points}DECL FDAT FALL={TOOL_NO 1,BASE_NO 3,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}\r
DECL FDAT FGUN={TOOL_NO 1,BASE_NO 3,IPO_FRAME #TCP,POINT2[] " "}\r
ENDDAT\r
"""
_SOURCE = """&ACCESS RVP\r
&PARAM EDITMASK = *\r
&PARAM TEMPLATE = C:\\KRC\\Roboter\\Template\\vorgabe\r
DEF  Pick( )\r
;FOLD PTP HOME Vel=100 % DEFAULT;%{PE}%R 5.5.32,%MKUKATPBASIS,%CMOVE,%VPTP,%P 1:PTP, 2:HOME {not read\r
$BWDSTART=FALSE\r
PTP XHOME ; PTP {X 1}\r
;ENDFOLD\r
FDAT_ACT=FALL\r
BAS(#PTP_PARAMS,100)\r
IF NOTE[1]=="x" THEN\r
ptp xp1 C_PTP\r
ENDIF\r
MOVES
SLIN XP9 WITH $VEL=SVEL_CP(0.5,,L1), $TOOL=STOOL2(FALL), $BASE=SBASE(FALL.BASE_NO), $LOAD=SLOAD(FALL.TOOL_NO) C_SPL\r
LIN INLINE C_DIS\r
PTP {A1 5,A2 -80.5,A3 95,A4 0,A5 30,A6 7.25,E1 0}\r
LIN_REL {Z 50} #BASE\r
LIN XP1:{Z 50}\r
FDAT_ACT=FGUN\r
BAS(#CP_PARAMS,0.2)\r
LIN XP11\r
END\r
"""


def status(q: np.ndarray, behind: bool, below: bool) -> tuple[int, int]:
    """S and T of a solution."""
    return behind + 2 * (not below) + 4 * int(q[4] < 0), sum(int(angle < 0) << k for k, angle in enumerate(q))


def point(q: np.ndarray, *, wrong: bool = False) -> str:
    """E6POS in the base at joint positions, degrees; with wrong S and T, as programs made off line have them in straight motions."""
    goal = KR6.flange_at(q)
    at = np.linalg.inv(_BASE) @ goal @ _TOOL
    ((_, behind, below),) = [s for s in KR6.whole_turns(goal) if np.abs(s[0] - q).max() < 1e-6]
    r = at[:3, :3]
    abc = np.rad2deg([np.arctan2(r[1, 0], r[0, 0]), np.arcsin(-r[2, 0]), np.arctan2(r[2, 1], r[2, 2])])
    s, t = (0, 63) if wrong else status(q, behind, below)
    xyz = at[:3, 3] * 1e3
    numbers = ",".join(f"{n} {v:.7f}" for n, v in zip("XYZABC", [*xyz, *abc], strict=True))
    return f"{{{numbers},S {s},T {t},E1 0.0,E2 0.0}}"


def moved(source: str, data: str, config: str) -> list[np.ndarray]:
    """Joint positions, degrees, of the motions of a program, run line by line."""

    def values(text: str) -> dict[str, float]:
        return {name: float(value) for name, value in re.findall(r"([A-Z]\d?) (-?\d+\.?\d*)", text.upper())}

    known = {
        name.upper(): values(body)
        for name, body in re.findall(r"(?:E6POS|E6AXIS) (\w+)=(\{[^}]*\})", config + data)
    }
    q, stops = np.zeros(6), []
    for line in source.replace("\r", "").splitlines():
        call = re.match(r"(S?PTP|S?LIN) (\{[^}]*\}|\w+)(:?)", line.split(";")[0], re.I)
        if not call or call[3] or (call[2][0] != "{" and call[2].upper() not in known) or call[2] == "XP11":
            continue
        value = values(call[2]) if call[2][0] == "{" else known[call[2].upper()]
        if "A1" in value:
            q = np.array([value[f"A{k}"] for k in range(1, 7)])
        else:
            goal = _BASE @ posed(*(value[n] for n in "XYZABC")) @ np.linalg.inv(_TOOL)
            every = KR6.whole_turns(goal)
            if "PTP" in call[1].upper():
                fits = [s[0] for s in every if status(*s) == (value["S"], value["T"])]
                assert len(fits) == 1, line
                (q,) = fits
            else:
                now = [s for s in KR6.whole_turns(KR6.flange_at(q)) if np.abs(s[0] - q).max() < 1e-5]
                kept = [s[0] for s in every if status(*s)[0] == status(*now[0])[0]]
                q = min(kept, key=lambda each: float(np.abs(each - q).max()))
        stops.append(q)
    return stops


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Arm]:
    """A calibrated KR 6 and its program."""
    folder, arm = tmp_path_factory.mktemp("krl"), KR6.true_one(5)
    arm.measured(folder, _TOOL[:3, 3])
    calibrate_cell(folder)
    rng = np.random.default_rng(4)
    stops = KR6.middle() + rng.uniform(-35, 35, (11, 6))
    stops[3, 4] = -50.0  # the wrist flipped
    stops[4, [3, 5]] = -150.0, 250.0  # beyond half a turn
    stops[5] = [-100.0, -140.0, 40.0, 30.0, 70.0, -300.0]  # wrist centre behind axis 1
    stops[6] = [12.0, -30.0, -20.0, 5.0, 60.0, 3.0]
    stops[7, [0, 3]] = -0.001, 0.001  # next to the steps of T
    stops[8:] = stops[7] + rng.uniform(-15, 15, (3, 6))  # along lines from the one before
    names = [*(f"XP{k}" for k in range(1, 11)), "INLINE"]
    points = "".join(
        f"DECL {'GLOBAL ' * (k == 2)}E6POS {name}={point(q, wrong=k > 8)}\r\n"
        for k, (name, q) in enumerate(zip(names, stops, strict=True))
    )
    points += f"DECL E6POS XP11={point(stops[0])}\r\n"
    moves = "".join(f"PTP XP{k} C_PTP\r\n" for k in range(2, 9))
    (folder / "Pick.src").write_bytes(
        _SOURCE.replace("MOVES\r\n", moves).replace("MOVES\n", moves).encode("latin-1")
    )
    (folder / "pick.DAT").write_bytes(_DATA.replace("{points}", points).encode("latin-1"))
    (folder / "R1").mkdir()
    (folder / "R1" / "$config.dat").write_text(_CONFIG, "latin-1")
    return folder, arm


def filtered(folder: Path, source: str, out: str, *more: str) -> int:
    """Exit code of the verb."""
    files = [str(folder / source / "Pick.src"), str(folder / "R1" / "$config.dat")]
    options = ["--estimates", str(folder / "out"), "--out", str(folder / out), *more]
    return main(["filter", str(folder / "robot.yaml"), *files, *options])


def texts(folder: Path) -> tuple[str, str]:
    """Texts of both files."""
    source, data = ((folder / name).read_bytes().decode("latin-1") for name in ("Pick.src", "pick.DAT"))
    return source, data


def test_the_corrected_program_brings_the_true_tool_there(
    cell: tuple[Path, Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, arm = cell
    limit = verified_error(folder, capsys)
    assert filtered(folder, ".", "new", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    before, after = texts(folder), texts(folder / "new")
    config = [(folder / place / "$config.dat").read_text("latin-1") for place in ("R1", "new")]
    wanted, now = moved(*before, config[0]), moved(*after, config[1])
    assert len(wanted) == len(now) == 12
    goals = np.array([(KR6.flange_at(q) @ _TOOL)[:3, 3] for q in wanted])
    errors = [
        registered(np.array([(arm.flange_at(q) @ _TOOL)[:3, 3] for q in each]), goals)
        for each in (wanted, now)
    ]
    assert errors[0].mean() > 2e-4
    assert errors[1].mean() < 1.1 * limit < 3e-5
    assert np.abs(np.array(wanted) - np.array(now)).max() < 1.0, "no configuration is left"
    number = r"-?\d*\.\d+|-?\d+"
    for one, other in zip(before, after, strict=True):
        assert re.sub(number, "0", one) == re.sub(number, "0", other), "only numbers change"
    assert config[0].splitlines()[:6] == config[1].splitlines()[:6], "tools and bases stay"
    told = [item["reason"] for item in found["left"]]
    assert len(told) == 3, told
    assert any("relative to where the robot stands" in reason for reason in told)
    assert any("from XP1 as corrected" in reason for reason in told)
    assert any("the tool stands still" in reason for reason in told)


def test_reverse_returns_the_numbers(cell: tuple[Path, Arm]) -> None:
    folder, _ = cell
    assert filtered(folder, ".", "there") == 0
    files = [str(folder / "there" / name) for name in ("Pick.src", "$config.dat")]
    options = ["--estimates", str(folder / "out"), "--out", str(folder / "back"), "--reverse"]
    assert main(["filter", str(folder / "robot.yaml"), *files, *options]) == 0
    for k in range(2):
        first, there, back = (
            np.array([float(x) for x in re.findall(r"-?\d+\.?\d*", texts(folder / name)[k])])
            for name in (".", "there", "back")
        )
        # millimetres and degrees: 1e-6 m and 1e-6 rad
        assert np.abs(back - first).max() < 1e-5 < np.abs(there - first).max()


def test_lines_are_divided(cell: tuple[Path, Arm], capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = cell
    capsys.readouterr()
    assert filtered(folder, ".", "divided", "--subdivide", "0.002") == 0
    assert filtered(folder, ".", "undivided") == 0
    assert "points inserted in 2 motions" in " ".join(capsys.readouterr().out.split())
    (source, data), (divided, same) = texts(folder / "undivided"), texts(folder / "divided")
    assert data == same and "\r\n" in divided
    new = [line for line in divided.splitlines() if line not in source.splitlines()]
    assert new and [line for line in divided.splitlines() if line not in new] == source.splitlines()
    first = next(line for line in source.splitlines() if line.startswith("SLIN"))
    for line in new:
        number = r"-?\d+\.?\d*"
        shape = rf"(S?LIN) \{{X {number},Y {number},Z {number},A {number},B {number},C {number},S \d+,T \d+,E1 0.0,E2 0.0\}} .*"
        assert re.fullmatch(shape, line), line
        assert not line.startswith("SLIN") or line.endswith(first[first.index(" WITH") :])


_HEAD = "DEF m()\n$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\n$BASE=NULLFRAME\n"
_UP = "{X 500,Y 0,Z 500,A 0,B 90,C 0,S 2,T 2}"


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("PTP {A1 0\n", 2, "E-PROG-001"),
        (
            f"BAS(#TOOL,4)\n$BASE=NULLFRAME\nPTP {_UP}\n",
            0,
            "TOOL_DATA[4] is not in the files given: give $config.dat too",
        ),
        (
            f"$TOOL=NULLFRAME\nBAS(#BASE,4)\nPTP {_UP}\n",
            0,
            "BASE_DATA[4] is not in the files given: give $config.dat too",
        ),
        (f"$TOOL=NULLFRAME\nPTP {_UP}\n", 0, "sets no base ($BASE, FDAT_ACT)"),
        (f"$BASE=NULLFRAME\nPTP {_UP}\n", 0, "give --tool"),
        (f"{_HEAD}$BASE=EK(ROOT,1,OFFSET)\nPTP {_UP}\n", 0, "an external kinematic system carries the base"),
        (f"{_HEAD}PTP {_UP}\n", 0, "1 targets corrected"),
        (f"{_HEAD}PTP {_UP[:-9]},S 'B010',T 'B000010'}}\n", 0, "1 targets corrected"),
        (f"{_HEAD}PTP {_UP[:-9]},S 3,T 2}}\n", 0, "has the configuration (3, 2)"),
        (f"{_HEAD}PTP {_UP.replace('Y 0', 'Y 5')}\n", 0, "1 targets corrected"),
        (f"{_HEAD}PTP {_UP.replace('Y 0', 'Y 50')}\n", 0, "has the configuration (2, 2)"),
        (
            f"$ROBROOT={{X 0,Y 500,Z 0,A 0,B 0,C 0}}\n{_HEAD}PTP {_UP.replace('Y 0', 'Y 500')}\n",
            0,
            "1 targets corrected",
        ),
        (f"{_HEAD}PTP {_UP[:-9]}}}\n", 0, "--start"),
        (f"{_HEAD}LIN {{X 10}}\n", 0, "only some of its numbers are written"),
        (f"{_HEAD}P1={_UP}\nP1.Z=600\nPTP P1\n", 0, "set more than once"),
        (f"{_HEAD}P1={_UP}\nLIN_OFFS(P1,0,0,30)\n", 0, "no motion with plain arguments goes to it"),
        (f"{_HEAD}P1={_UP}\nPTP P1\nEND\nDEF n()\nLIN P1\n", 0, "1 targets corrected"),
        (
            f"{_HEAD}P1={_UP}\nPTP P1\n$BASE={{X 1,Y 0,Z 0,A 0,B 0,C 0}}\nPTP P1\n",
            0,
            "reached in different frames",
        ),
        (f"{_HEAD}PTP {_UP[:-1]},E1 200.0}}\n", 0, "external axes"),
        (f"{_HEAD}PTP XFAR\n", 0, "give the data list (.dat) that has it too"),
    ],
)
def test_what_stays_is_said(
    cell: tuple[Path, Arm], text: str, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = cell
    (folder / "odd.src").write_text(text, "utf-8")
    capsys.readouterr()
    options = ["--estimates", str(folder / "out"), "--out", str(folder / "odd_new.src")]
    assert main(["filter", str(folder / "robot.yaml"), str(folder / "odd.src"), *options]) == code
    told = " ".join("".join(capsys.readouterr()).split())
    assert said in told


def test_a_urdf_that_counts_generically(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The URDF has other signs and zeros than the controller: told, and right with both given."""
    KR6.true_one(3).measured(tmp_path, _TOOL[:3, 3], counted=False)
    (tmp_path / "p.src").write_text(f"{_HEAD}PTP {_UP}\nPTP {{A1 0,A2 -80,A3 95,A4 0,A5 30,A6 7.25}}\n")
    calibrated = [
        "calibrate",
        str(tmp_path / "robot.yaml"),
        str(tmp_path / "points.csv"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(calibrated) == 0
    options = ["--estimates", str(tmp_path / "out"), "--out", str(tmp_path / "q.src")]
    capsys.readouterr()
    assert main(["filter", str(tmp_path / "robot.yaml"), str(tmp_path / "p.src"), *options]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "joint 1 turns about +z where the controller's turns about -z" in said
    told = [
        "--joint-signs",
        "-1",
        "1",
        "1",
        "-1",
        "1",
        "-1",
        "--joint-zeros",
        "0",
        "90",
        "-90",
        "0",
        "0",
        "0",
    ]
    assert (
        main(["filter", str(tmp_path / "robot.yaml"), str(tmp_path / "p.src"), *options, *told, "--json"])
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert not found["remarks"] and not found["left"]
    arm = KR6.true_one(3)
    for item in found["targets"]:
        q = np.array(item["after"])
        if item["kind"] == "joints":
            goal, there = KR6.flange_at(np.array(item["before"])), arm.flange_at(q)
            assert np.abs((there - goal)[:3, 3]).max() < 4e-4
            assert np.abs(q - item["before"]).max() < 0.5


def test_other_bits_of_the_status_stay() -> None:
    posture = np.array([0.1, -1.0, 1.5, 0.2, -0.5, 0.3, 0.5, 0.2])
    rule = StatusAndTurn()
    assert rule.words(rule.levels(posture), ("16", "0")) == ("22", "18")
    assert rule.words(rule.levels(posture), ("'B10000'", "'B000000'")) == ("'B10110'", "'B010010'")
    assert rule.distance(posture, ("6", "18")) == 0 and rule.distance(posture, ("6", "19")) == np.inf
    posture[0] = -0.01
    assert 0 < rule.distance(posture, ("6", "18")) < 0.02 and rule.distance(posture, ("2", "18")) == np.inf
