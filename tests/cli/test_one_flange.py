"""One flange for all verbs: a tip that was touched beside a calibration is met, wherever the reflector was declared."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import polars as pl
import pytest
from stranger_arm import rigid, rodrigues
from yielding_arm import YieldingArm, touches

from flexcal import CalibratedRobot
from flexcal.calibration.accuracy import predicted_rms
from flexcal.calibration.measurement import propagation
from flexcal.export.urdf import render_urdf
from flexcal.jobs.inputs import beyond_calibration
from flexcal.kernels import RuntimeRobot
from flexcal.model.kinematics import point_kinematics

OFFS = [0.0, 0.002, 0.015]
EXTRAPOLATED = "the predicted error is above three times that near the calibrated poses"


def calibrated(run, folder: Path, off: float, *, written: bool, seed: int = 1) -> tuple[YieldingArm, Path]:
    """An arm, and its robot.yaml with a calibration beside; the reflector is `off` m from its declared place."""
    away = off * np.array([0.6, -0.64, 0.48])
    truth = np.array([0.05, 0.03, 0.08])
    arm = YieldingArm(seed, declared_xyz=tuple((truth - away).tolist()), point_error=tuple(away.tolist()))
    robot, rng = arm.write(folder), np.random.default_rng(seed)
    robot.write_text(robot.read_text().replace("[kinematic]", "[kinematic, gravity_compliance]"))
    q = arm.postures(60, rng)
    poses = arm.write_poses(folder / "poses.csv", q, arm.measured(q, rng))
    outcome = run("calibrate", robot, poses, *(("--write-point",) if written else ()))
    assert outcome.status == 0, outcome.err
    return arm, robot


def touched_tip(run, arm: YieldingArm, robot: Path, *, first: bool = False) -> np.ndarray:
    """Copy the line of `identify tool` into robot.yaml, before the reflector's or after it; the tip's place in it, m."""
    places = [("p", np.array([0.75, 0.1, 0.6]))] * 14
    file = touches(arm, robot.with_name("touches.csv"), places, np.random.default_rng(3))
    found = run("identify", "tool", robot, file, "--frame", "tool0", "--json").document
    error, half, own = (np.array(found[key]) for key in ("xyz_m", "half_width_m", "own_half_width_m"))
    assert (np.abs(error - arm.tip) <= half).all()
    assert own.max() < 1e-4 < half.min()
    outcome = run("identify", "tool", robot, file, "--frame", "tool0")
    assert outcome.status == 0, outcome.err
    line = re.search(r"points: \{(tip: \{.*\})\}", outcome.out)
    assert line is not None
    text = robot.read_text()
    after = re.search(r"points:\n(  smr:.*\n)", text)
    assert after is not None
    at = after.start(1) if first else after.end(1)
    robot.write_text(f"{text[:at]}  {line[1]}\n{text[at:]}")
    xyz = re.search(r"xyz: \[(.*?)\]", line[1])
    assert xyz is not None
    return np.array([float(value) for value in xyz[1].split(",")])


def missed(run, arm: YieldingArm, robot: Path) -> np.ndarray:
    """Distances (N,), m, of the real tip from its targets, their base placed by best fit, with the commands of `compensate`."""
    q = arm.postures(25, np.random.default_rng(5), 0.6)
    header = [f"q{i + 1}" for i in range(arm.n)]
    numbers = pl.DataFrame(q, schema=header).with_row_index("pose")
    numbers.write_csv(robot.with_name("targets.csv"))
    out = robot.with_name("commands.csv")
    outcome = run("compensate", robot, robot.with_name("targets.csv"), "--target", "tip", "--out", out)
    assert outcome.status == 0, outcome.err
    assert "does not belong to this robot" not in outcome.out and EXTRAPOLATED not in outcome.out
    commands = pl.read_csv(out)
    wanted = arm.at(q[commands["pose"].to_numpy()], np.array(arm.tip), true=False)
    real = arm.at(commands.select(header).to_numpy(), np.array(arm.tip))
    centre, there = wanted.mean(axis=0), real.mean(axis=0)
    u, _, vt = np.linalg.svd((wanted - centre).T @ (real - there))
    turn = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
    return np.linalg.norm(real - there - (wanted - centre) @ turn.T, axis=1)


def tips(urdf: str, q: np.ndarray) -> np.ndarray:
    """The tip (N, 3), m, by Pinocchio."""
    model = pin.buildModelFromXML(urdf)
    data, frame, found = model.createData(), model.getFrameId("tip"), []
    for row in q:
        pin.framesForwardKinematics(model, data, row)
        found.append(data.oMf[frame].translation.copy())
    return np.array(found)


def turned(axis: str, angle: float) -> np.ndarray:
    return rigid(rodrigues(np.eye(3)["xyz".index(axis)], angle), np.zeros(3))


def moved(axis: str, by: float) -> np.ndarray:
    return rigid(np.eye(3), by * np.eye(3)["xyz".index(axis)])


def placed(frame: dict[str, float]) -> np.ndarray:
    """Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll), of what is named of it."""
    turns = [
        turned(axis, frame.get(name, 0.0)) for name, axis in (("yaw", "z"), ("pitch", "y"), ("roll", "x"))
    ]
    at = np.linalg.multi_dot([np.eye(4), *turns])
    at[:3, 3] = [frame.get(axis, 0.0) for axis in "xyz"]
    return at


def table(path: Path, column: str) -> dict[str, dict[str, float]]:
    """Values of an exported table, by joint and parameter."""
    found: dict[str, dict[str, float]] = {}
    for row in pl.read_csv(path, comment_prefix="#").iter_rows(named=True):
        found.setdefault(row["joint"], {})[row["parameter"]] = row[column]
    return found


def exported_tips(
    run, arm: YieldingArm, robot: Path, q: np.ndarray, declared: np.ndarray
) -> dict[str, np.ndarray]:
    """The tip (N, 3), m, by the table, the offsets, the JSON document and the runtime's file, read as their comments and pages say.

    The tip is `declared` in robot.yaml.
    """

    def export(form: str, name: str, *options: str) -> Path:
        outcome = run("export", form, robot, "--out", robot.with_name(name), *options)
        assert outcome.status == 0, outcome.err
        return robot.with_name(name)

    rows, all_at = table(export("mdh", "mdh.csv", "--point", "tip"), "calibrated"), []
    base, tool = placed(rows.pop("base")), placed(rows.pop("tool"))
    for own in q:
        at = base
        for row, angle in zip(rows.values(), own, strict=True):
            across = [turned("x", row["alpha"]), moved("x", row["a"]), turned("y", row["beta"])]
            at = np.linalg.multi_dot([at, *across, turned("z", row["theta"] + angle), moved("z", row["d"])])
        all_at.append((at @ tool)[:3, 3])
    found = {"mdh": np.array(all_at)}
    rows = table(export("offsets", "offsets.csv", "--point", "tip"), "value")
    base, tool = placed(rows.pop("base")), placed(rows.pop("tool"))
    offsets = np.array([row["offset"] for row in rows.values()])
    there = arm.at(q + offsets, declared + tool[:3, 3], true=False)
    found["offsets"] = there @ base[:3, :3].T + base[:3, 3]
    document = json.loads(export("json", "robot.json").read_text())
    all_at = []
    for own in q:
        at = np.eye(4)
        for joint, angle in zip(document["joints"], own, strict=True):
            turn = rodrigues(np.array(joint["axis"]), angle)
            at = at @ np.array(joint["placement"]["matrix"]) @ rigid(turn, np.zeros(3))
        all_at.append((at @ np.array(document["points"]["tip"]["placement"]["matrix"]))[:3, 3])
    found["json"] = np.array(all_at)
    runtime = RuntimeRobot.read(export("runtime", "runtime.json").read_text())
    tip, none = runtime.point_names.index("tip"), np.full(len(q), np.nan)
    found["runtime"] = runtime.forward(q, tip, none, np.zeros((0, arm.n)))[0]
    return found


def said_by_others(run, arm: YieldingArm, robot: Path) -> dict[str, np.ndarray]:
    """The same in other verbs: where the tip is by the calibrated geometry and by the exported URDF, what a filtered program commands, and
    where a work object lies, m.
    """
    q, tip = arm.postures(10, np.random.default_rng(9), 0.6), np.array(arm.tip)
    outcome = run("export", "urdf", robot, "--out", robot.with_name("exported.urdf"))
    assert outcome.status == 0, outcome.err
    geometry = render_urdf(CalibratedRobot.from_yaml(robot).probable).text
    calibrated, exported = (
        tips(text, q) for text in (geometry, robot.with_name("exported.urdf").read_text())
    )
    lines = "".join(f"  movej([{', '.join(f'{x:.12f}' for x in row)}], a=1, v=1)\n" for row in q)
    tool = ", ".join(f"{x:.9f}" for x in (*tip, 0, 0, 0))
    robot.with_name("p.script").write_text(f"def p():\n  set_tcp(p[{tool}])\n{lines}end\n")
    new = robot.with_name("new.script")
    outcome = run("filter", robot, robot.with_name("p.script"), "--out", new)
    assert outcome.status == 0, outcome.err
    rows = re.findall(r"movej\(\[(.*?)\]", new.read_text())
    commanded = np.array([[float(x) for x in row.split(",")] for row in rows])
    assert np.linalg.norm(arm.at(commanded, tip) - arm.at(q, tip), axis=1).min() > 1e-4
    places = [("origin", [0.7, 0.1, 0.6]), ("x", [0.85, 0.1, 0.6]), ("xy", [0.75, 0.25, 0.6])]
    file = touches(
        arm,
        robot.with_name("object.csv"),
        [(name, np.array(at)) for name, at in places],
        np.random.default_rng(4),
    )
    found = run("identify", "frame", robot, file, "--point", "tip", "--json").document
    return {
        "calibrated": calibrated,
        "exported": exported,
        "filtered": arm.at(commanded, tip),
        "frame": np.array(found["xyz_m"]),
        "frame_axes": 0.2 * np.array(found["rpy_rad"]),
    }


@pytest.mark.parametrize("first", [False, True], ids=["after", "before"])
def test_the_tip_is_the_same_wherever_the_reflector_was_declared(tmp_path: Path, run, first: bool) -> None:
    """Calibrated, touched, and the line copied before or after the reflector's, which `tool.length_x` stays the error of."""
    places, reached, others, files = [], [], [], []
    q = YieldingArm().postures(20, np.random.default_rng(8))
    for off in OFFS:
        for written in (False, True):
            arm, robot = calibrated(run, tmp_path / f"{off}{written}", off, written=written)
            places.append(touched_tip(run, arm, robot, first=first))
            model = CalibratedRobot.from_yaml(robot).probable
            reached.append(
                [point_kinematics(model, q, point=name, jacobians=False).position for name in ("tip", "smr")]
            )
            others.append(said_by_others(run, arm, robot))
            if off == OFFS[-1] or not files:
                files.append(exported_tips(run, arm, robot, q[:10], places[-1]))
                rigid_tips = tips(render_urdf(model).text, q[:10])
                assert np.abs(files[-1]["json"] - rigid_tips).max() < 1e-8
            assert np.median(missed(run, arm, robot)) < 3e-4
    assert np.abs(np.array(places) - places[0]).max() < 1e-5
    assert np.abs(np.array(reached) - reached[0]).max() < 1e-5
    for each in (others, files):
        for name, first_said in each[0].items():
            assert np.abs(np.array([said[name] for said in each]) - first_said).max() < 1e-5, name


@pytest.mark.parametrize("first", [False, True], ids=["after", "before"])
def test_a_touched_tip_is_beyond_where_the_arm_is(tmp_path: Path, run, first: bool) -> None:
    """Not where the flange's rotation, which no point tells, is in its predicted error: that is so at every pose."""
    arm, robot = calibrated(run, tmp_path, 0.002, written=False)
    touched_tip(run, arm, robot, first=first)
    rng = np.random.default_rng(6)
    q = arm.postures(20, rng)
    fresh = arm.write_poses(tmp_path / "fresh.csv", q, arm.measured(q, rng))
    outcome = run("verify", robot, fresh)
    assert outcome.status == 0 and EXTRAPOLATED not in outcome.out, outcome.err
    known = CalibratedRobot.from_yaml(robot)
    far = rng.uniform(-3, 3, (500, 6))
    at_tip, at_reflector = (beyond_calibration(known, far, np.full(500, name)) for name in ("tip", "smr"))
    assert not beyond_calibration(known, q, np.full(20, "tip")).any()
    assert (at_tip > 0).mean() > (at_reflector > 0).mean() > 0.3


def test_a_calibration_whose_point_is_gone_is_refused(tmp_path: Path, run) -> None:
    arm, robot = calibrated(run, tmp_path, 0.002, written=False)
    touched_tip(run, arm, robot)
    robot.write_text(re.sub(r"  smr:.*\n", "", robot.read_text()))
    outcome = run("export", "urdf", robot, "--out", tmp_path / "new.urdf")
    assert (outcome.status, outcome.out) == (2, "")
    assert "E-ROBOT-084" in outcome.err and "smr" in outcome.err


def test_what_no_point_tells_is_in_no_predicted_error_of_the_point(tmp_path: Path, run) -> None:
    """Tolerances of the flange move the reflector by their rotation times 15 mm, were it where robot.yaml declares it."""
    arm, robot = calibrated(run, tmp_path, 0.015, written=False)
    known = CalibratedRobot.from_yaml(robot)
    q = arm.postures(60, np.random.default_rng(1))
    told, whole = (
        np.mean(predicted_rms(propagation(model, target="smr"), q)) for model in (known.model, known.probable)
    )
    assert told <= whole < 1.05 * told
