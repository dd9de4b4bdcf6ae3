"""Lines and arcs between corrected targets: what is said of them against a controller that interpolates by itself, and divided lines."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from six_axis_arm import IRB120, Arm, frame, quaternion, turned_by

from flexcal.cli.main import main
from flexcal.jobs.deployment.tool_paths import ToolPath
from flexcal.programs import Pose

_TOOL = frame(np.eye(3), np.array([0.031, 0.0, 0.1]))
_NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
_SHARES = (0.25, 0.5, 0.75)


def robtarget(q: np.ndarray) -> str:
    """A robtarget in the base at joint positions, degrees."""
    at = IRB120.flange_at(q) @ _TOOL
    ((_, behind, below),) = [
        s for s in IRB120.whole_turns(IRB120.flange_at(q)) if np.abs(s[0] - q).max() < 1e-6
    ]
    xyz, turn = (",".join(f"{v:.9f}" for v in part) for part in (at[:3, 3] * 1e3, quaternion(at[:3, :3])))
    conf = [int(q[k] // 90) for k in (0, 3, 5)] + [4 * behind + 2 * below + int(q[4] < 0)]
    return f"[[{xyz}],[{turn}],[{','.join(map(str, conf))}],{_NONE}]"


def poses(text: str) -> list[np.ndarray]:
    """Poses of the tool at the MoveJ and MoveL of a program in their order, all inline or by name."""
    known = {name: body for name, body in re.findall(r"robtarget (\w+):=(\[\[.*\]\]);", text)}
    found = []
    for first in re.findall(r"Move[JL] (\[\[.*?\]\]|\w+),(?:(\[\[.*?\]\]|\w+),)?v", text):
        for each in filter(None, first):
            value = json.loads(known.get(each, each).replace("9E9", "9e9"))
            found.append(frame(turned_by(np.array(value[1])), np.array(value[0]) / 1e3))
    return found


def driven(arm: Arm, stops: list[np.ndarray], q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the true tool and of the controller's on the lines between poses: K per line, and at their ends."""
    real, nominal = [], []
    for first, last in pairwise(stops):
        wxyz = quaternion(first[:3, :3].T @ last[:3, :3])
        wxyz = wxyz if wxyz[0] > 0 else -wxyz
        half = np.arctan2(np.linalg.norm(wxyz[1:]), wxyz[0])
        axis = wxyz[1:] / max(float(np.linalg.norm(wxyz[1:])), 1e-15)
        for share in (*_SHARES, 1.0):
            turn = first[:3, :3] @ turned_by(np.array([np.cos(share * half), *(np.sin(share * half) * axis)]))
            at = frame(turn, first[:3, 3] + share * (last[:3, 3] - first[:3, 3]))
            every = IRB120.whole_turns(at @ np.linalg.inv(_TOOL))
            q = min((s[0] for s in every), key=lambda each: float(np.abs(each - q).max()))
            real.append((arm.flange_at(q) @ _TOOL)[:3, 3])
            nominal.append(at[:3, 3])
    return np.array(real), np.array(nominal)


def base_of(arm: Arm, before: str, after: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3), from the right, and shift from the true base to the one that the calibration means, by joint targets."""
    joints = (
        np.array([json.loads(row) for row in re.findall(r"MoveAbsJ \[(\[.*?\])", text)])
        for text in (before, after)
    )
    goals, real = (
        np.array([(each.flange_at(q) @ _TOOL)[:3, 3] for q in rows])
        for each, rows in zip((IRB120, arm), joints, strict=True)
    )
    mean, aim = real.mean(axis=0), goals.mean(axis=0)
    left, _, right = np.linalg.svd((real - mean).T @ (goals - aim))
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    return turn, aim - mean @ turn


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Arm, list[np.ndarray]]:
    """An arm with errors of 3 mm and 5 mrad, calibrated; a program with long lines, and the joint positions of its targets."""
    folder, arm = tmp_path_factory.mktemp("paths"), IRB120.true_one(3)
    assert arm.errors is not None
    arm = replace(arm, errors=10 * arm.errors)
    arm.measured(folder, _TOOL[:3, 3])
    calibrated = [
        "calibrate",
        str(folder / "robot.yaml"),
        str(folder / "points.csv"),
        "--out",
        str(folder / "out"),
    ]
    assert main(calibrated) == 0
    stops = [
        np.array(each)
        for each in ([-40.0, 10, 10, 5, 60, 20], [45.0, 20, 5, 10, 65, 60], [-20.0, -25, 35, 20, 40, 10])
    ]
    names = [f"CONST robtarget p{k}:={robtarget(q)};" for k, q in enumerate(stops)]
    tool = "PERS tooldata t:=[TRUE,[[31,0,100],[1,0,0,0]],[0.1,[0,0,1],[1,0,0,0],0,0,0]];"
    rng = np.random.default_rng(6)
    spread = IRB120.middle() + rng.uniform(-40, 40, (30, 6))
    absolute = [f"MoveAbsJ [[{','.join(map(repr, q.tolist()))}],{_NONE}],v100,z1,t;" for q in spread]
    moves = ["MoveJ p0,v100,z1,t;", "\tMoveL p1,v100,z1 ,t; ! long", "IF a THEN MoveL p2,v100,z1,t; ENDIF"]
    text = "\r\n".join(
        ["MODULE m", *names, tool, "PROC main()", *absolute, *moves, "ENDPROC", "ENDMODULE", ""]
    )
    (folder / "lines.mod").write_bytes(text.encode())
    return folder, arm, stops


def filtered(folder: Path, source: str, out: str, *more: str) -> int:
    """Exit code of the verb."""
    options = ["--estimates", str(folder / "out"), "--out", str(folder / out), *more]
    return main(["filter", str(folder / "robot.yaml"), str(folder / source), *options])


def test_what_lines_miss_is_told_and_divided(
    cell: tuple[Path, Arm, list[np.ndarray]], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, arm, stops = cell
    capsys.readouterr()
    assert filtered(folder, "lines.mod", "new.mod", "--json") == 0
    told = [item["between_mm"] for item in json.loads(capsys.readouterr().out)["targets"][-3:]]
    assert told[0] is None
    before, after = ((folder / name).read_bytes().decode() for name in ("lines.mod", "new.mod"))
    turn, shift = base_of(arm, before, after)
    real, _ = driven(arm, poses(after), stops[0])
    _, wanted = driven(IRB120, poses(before), stops[0])
    missed = np.linalg.norm(real @ turn + shift - wanted, axis=1) * 1e3
    assert missed[3::4].max() < 0.06  # at the targets
    for line in range(2):
        most = missed[4 * line : 4 * line + 3].max()
        assert most > 0.2 and told[line + 1] == pytest.approx(most, abs=0.06)
    assert filtered(folder, "lines.mod", "divided.mod", "--subdivide", "0.05") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "points inserted in 1 motions" in said
        and "not divided, though they miss it by more: the motions to p2" in said
    )
    divided = (folder / "divided.mod").read_bytes().decode()
    stages = poses(divided)[:-1]
    real, _ = driven(arm, stages, stops[0])
    first, last = (pose[:3, 3] for pose in poses(before)[:2])
    parts = len(stages) - 1
    at = (np.repeat(np.arange(parts), 4) + np.tile([*_SHARES, 1.0], parts)) / parts
    ideal = first + at[:, None] * (last - first)
    assert parts > 1
    assert np.linalg.norm(real @ turn + shift - ideal, axis=1).max() < 0.05e-3 + 0.06e-3
    inserted = [row for row in divided.splitlines() if row.startswith("\tMoveL [[")]
    assert all(row.endswith(",v100,z1 ,t;") for row in inserted) and len(inserted) == len(poses(divided)) - 3
    assert [row for row in divided.splitlines() if "! long" in row] == ["\tMoveL p1,v100,z1 ,t; ! long"]


def test_wrong_limits_are_refused(
    cell: tuple[Path, Arm, list[np.ndarray]], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _, _ = cell
    for more in (["--subdivide", "0"], ["--subdivide", "0.1", "--reverse"]):
        assert filtered(folder, "lines.mod", "never.mod", *more) == 2
        assert "E-PROG-011" in capsys.readouterr().err
    assert not (folder / "never.mod").exists()


def test_an_arc_goes_through_its_points() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        centre, normal = rng.normal(size=(2, 3))
        normal /= np.linalg.norm(normal)
        u = np.cross(normal, rng.normal(size=3))
        u /= np.linalg.norm(u)
        v, radius = np.cross(normal, u), rng.uniform(0.1, 2)
        via, end = np.sort(rng.uniform(0.1, 6.1, 2))
        at = {
            t: centre + radius * (np.cos(t) * u + np.sin(t) * v)
            for t in (0, via / 2, via, (via + end) / 2, end)
        }
        path = ToolPath(*(Pose(at[t], np.eye(3)) for t in (0, via, end)))
        for share, position in zip((0, 0.25, 0.5, 0.75, 1), at.values(), strict=True):
            assert np.abs(path.pose(share).position - position).max() < 1e-8
        assert path.distance(at[via / 2] + 0.01 * normal, 0.5) == pytest.approx(0.01)
