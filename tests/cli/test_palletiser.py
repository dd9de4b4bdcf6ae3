"""A stranger's palletiser: parallelograms carry what motors and springs do to the joints that follow."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from arm_points import assert_intervals_cover, prediction_of, write_points
from over_seeds import over_seeds
from palletiser import DRIVES, Palletiser, poses, turn, write_robot
from refusals import assert_refusal

from flexcal import read_poses, rigid_motion, tool_at_rest
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import predict_measurements
from flexcal.model.robot import RobotModel

KINEMATIC = ("--terms", "kinematic")


@pytest.mark.parametrize("mimic", [True, False])
def test_the_deflected_arm_is_the_strangers(tmp_path: Path, mimic: bool) -> None:
    """The weight of the upper arm loads motor 3 through the rod, and what motor 2 gives way by turns the elbow back."""
    model = RobotModel.from_yaml(write_robot(tmp_path, mimic=mimic))
    assert model.motor_names == ("joint_1", "joint_2", "joint_3", "joint_4") and model.n == 4
    true = replace(Palletiser.nominal(), drives=DRIVES)
    q = poses(40, np.random.default_rng(0))
    at = tool_at_rest(model, q, None, np.full(len(q), "smr"), jacobians=True)
    np.testing.assert_allclose(at.kinematics.position, true.reflector(q), rtol=0, atol=1e-10)
    rigid = tool_at_rest(model, q, None, np.full(len(q), "smr"), elastic=False).kinematics.position
    assert np.linalg.norm(rigid - at.kinematics.position, axis=1).max() > 3e-3
    h = 1e-5 * np.eye(4)
    slopes = np.stack([(true.reflector(q + e) - true.reflector(q - e)) / 2e-5 for e in h], axis=2)
    np.testing.assert_allclose(at.command_jacobian()[:, :3], slopes, rtol=0, atol=2e-8)


def test_the_jacobian_is_that_of_finite_differences(tmp_path: Path) -> None:
    path = write_robot(tmp_path, mimic=True)
    rng = np.random.default_rng(1)
    q = poses(6, rng)
    true = Palletiser.drawn(1)
    nominal = RobotModel.from_yaml(path)
    errors = [
        f"{joint}.{key}"
        for joint in nominal.joint_names
        for key in ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y", "length_z")
    ]
    model = nominal.with_values({name: 1e-3 * rng.normal() for name in errors})
    measured = read_poses(write_points(tmp_path / "points.csv", q, true.reflector(q)), model)
    further = [f"joint_{k}.drive.stiffness" for k in (2, 3)] + [
        "upper_arm.mass",
        "wrist.com_x",
        "payload.mass",
    ]
    further += ["elbow.gravity_compliance", "level.gravity_compliance_1", "joint_3.backlash"]
    names = [*errors, *further]
    at = predict_measurements(model, measured, jacobians=True)
    flank = at.rest.flank
    exact = at.jacobian(names)
    for k, name in enumerate(names):
        step = 1e-4 if "com" in name else 1e-6 * max(1.0, abs(model.value(name)))
        ends = [
            predict_measurements(
                model.with_values({name: model.value(name) + s}), measured, flank=flank
            ).position
            for s in (step, -step)
        ]
        slope = (ends[0] - ends[1]) / (2 * step)
        # first order, as for every robot: compliances of rigid joints do not change the load on springs
        relative = 2e-2 if "compliance" in name else 1e-5
        scale = max(float(np.abs(slope).max()), 1e-9)
        np.testing.assert_allclose(exact[:, :, k] / scale, slope / scale, rtol=0, atol=relative, err_msg=name)


def test_without_noise_the_fit_predicts_exactly(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path, mimic=False))
    true = replace(Palletiser.drawn(2), drives=DRIVES)
    rng = np.random.default_rng(2)
    q, fresh = poses(40, rng), poses(30, rng)
    here = read_poses(write_points(tmp_path / "points.csv", q, true.reflector(q)), model)
    fit = fit_geometry(model, here, terms=("kinematic",))
    there = read_poses(write_points(tmp_path / "fresh.csv", fresh, true.reflector(fresh)), model)
    before = predict_measurements(model, there).residual
    after = predict_measurements(fit.model, there).residual
    assert np.abs(before).max() > 3e-3 and np.abs(after).max() < 1e-6


def test_calibrated_verified_compensated(run, tmp_path: Path) -> None:
    robot, true, rng = write_robot(tmp_path, mimic=True), Palletiser.drawn(3), np.random.default_rng(3)
    q, fresh = poses(60, rng), poses(40, rng)
    points = write_points(tmp_path / "points.csv", q, true.measured(q, rng))
    checked = write_points(tmp_path / "checked.csv", fresh, true.measured(fresh, rng))
    assert run("calibrate", robot, points, *KINEMATIC).status == 0
    errors = run("verify", robot, checked, "--json").document["verification"]
    assert errors["measured"]["mean_mm"] < 0.06 and errors["nominal"]["mean_mm"] > 1.0, errors
    # targets as the tracker has them, where the robot as drawn would be
    aim = 0.9 * poses(30, rng)
    stand = (turn(2, 1.9) @ turn(0, 0.03))[0]
    wanted = Palletiser.nominal().reflector(aim) @ stand.T + [4.1, 0.6, 0.9]
    lines = [f"{i + 1},{x!r},{y!r},{z!r},tracker" for i, (x, y, z) in enumerate(wanted.tolist())]
    (tmp_path / "targets.csv").write_text("\n".join(["pose,x,y,z,station", *lines, ""]))
    outcome = run("compensate", robot, tmp_path / "targets.csv", "--out", tmp_path / "commands.csv")
    assert outcome.status == 0, outcome.err
    with (tmp_path / "commands.csv").open() as stream:
        rows = {
            int(row["pose"]): [float(row[f"q{k}"]) for k in range(1, 5)] for row in csv.DictReader(stream)
        }
    assert len(rows) >= 25
    kept = np.array(sorted(rows)) - 1
    reached = true.reflector(np.array([rows[i + 1] for i in kept])) @ stand.T + [4.1, 0.6, 0.9]
    assert np.linalg.norm(reached - wanted[kept], axis=1).mean() < 0.05e-3


def test_the_exported_urdf_has_what_mimic_can_say(run, tmp_path: Path) -> None:
    robot, true, rng = (
        write_robot(tmp_path, mimic=False, elastic=False),
        Palletiser.drawn(4),
        np.random.default_rng(4),
    )
    true = replace(true, drives=np.full(4, np.inf))
    q = poses(50, rng)
    write_points(tmp_path / "points.csv", q, true.measured(q, rng))
    assert run("calibrate", robot, tmp_path / "points.csv", *KINEMATIC).status == 0
    outcome = run("export", "urdf", robot, "--out", tmp_path / "found.urdf")
    assert "elbow" in outcome.out and "level" not in outcome.out.partition("URDF cannot say")[2], outcome.out
    text = (tmp_path / "found.urdf").read_text()
    assert '<mimic joint="joint_3" multiplier="-1.0" offset="0.0"' in text
    read = pin.buildModelFromXML(text)
    data, frame = read.createData(), read.getFrameId("smr")
    found = RobotModel.from_yaml(robot)
    fresh = poses(10, rng)
    ours = tool_at_rest(found, fresh, None, np.full(10, "smr"), elastic=False).kinematics.position
    theirs = np.zeros_like(ours)
    for k, own in enumerate(fresh):
        angles = dict(zip(found.motor_names, own, strict=True)) | {"elbow": own[2] - own[1], "level": -own[2]}
        pin.framesForwardKinematics(read, data, np.array([angles[name] for name in list(read.names)[1:]]))
        theirs[k] = data.oMf[frame].translation
    # what the points leave open is chosen anew for the export, the base frame among it
    rotation, shift = rigid_motion(theirs, ours)
    np.testing.assert_allclose(theirs @ rotation.T + shift, ours, rtol=0, atol=1e-8)
    assert run("export", "offsets", robot, "--out", tmp_path / "offsets.csv").status == 0
    with (tmp_path / "offsets.csv").open() as stream:
        rows = csv.DictReader(line for line in stream if not line.startswith("#"))
        zeros = {row["joint"]: float(row["value"]) for row in rows if row["parameter"] == "offset"}
    assert set(zeros) == set(found.motor_names)
    drawn, shift = Palletiser.nominal(), np.array([zeros[name] for name in found.motor_names])
    assert _apart(drawn.reflector(fresh + shift), ours) < 0.7 * _apart(drawn.reflector(fresh), ours)
    for format_name in ("mjcf", "dh"):
        refused = run(
            "export", format_name, robot, "--out", tmp_path / f"x.{'xml' if format_name == 'mjcf' else 'csv'}"
        )
        assert refused.status == 2
        assert_refusal(refused.err, "E-ROBOT-076", "elbow")


def _apart(points: np.ndarray, others: np.ndarray) -> float:
    """Root mean square distance of best-fit registered points."""
    rotation, shift = rigid_motion(points, others)
    return float(np.sqrt(np.mean((points @ rotation.T + shift - others) ** 2)))


def _with_elbow(path: Path, q: np.ndarray, xyz: np.ndarray, elbow: np.ndarray) -> Path:
    write_points(path, q, xyz)
    head, *rows = path.read_text().splitlines()
    joined = [f"{row},{value!r}" for row, value in zip(rows, elbow.tolist(), strict=True)]
    path.write_text("\n".join([f"{head},elbow", *joined, ""]))
    return path


def test_a_relation_that_contradicts_measured_angles(run, tmp_path: Path) -> None:
    robot, true, rng = write_robot(tmp_path, mimic=True), Palletiser.drawn(5), np.random.default_rng(5)
    q = poses(40, rng)
    xyz, elbow = true.measured(q, rng), q[:, 2] - q[:, 1]
    _with_elbow(tmp_path / "good.csv", q, xyz, elbow + 0.004)
    read_poses(tmp_path / "good.csv", RobotModel.from_yaml(robot))
    other = elbow.copy()
    other[7] += 0.3
    outcome = run("calibrate", robot, _with_elbow(tmp_path / "slip.csv", q, xyz, other))
    assert_refusal(
        outcome.err, "E-TABLE-042", "slip.csv line 9", "elbow", f"{other[7]:.4g}", f"{elbow[7]:.4g}"
    )
    outcome = run("calibrate", robot, _with_elbow(tmp_path / "sign.csv", q, xyz, q[:, 2] + q[:, 1]))
    assert_refusal(outcome.err, "E-TABLE-042", "sign.csv", "elbow")
    outcome = run("calibrate", robot, _with_elbow(tmp_path / "zero.csv", q, xyz, elbow + 0.5))
    assert_refusal(outcome.err, "E-TABLE-043", "zero.csv", "elbow", "0.5")


@pytest.mark.parametrize(
    ("right", "wrong", "refusal"),
    [
        ("joint_2: -1.0", "elbow_2: -1.0", ["E-ROBOT-069", "line", "elbow_2"]),
        ("joint_2: -1.0", "level: -1.0", ["E-ROBOT-066", "elbow", "level"]),
        ("joint_2: -1.0", "joint_2: 0", ["E-ROBOT-063", "elbow"]),
        ("{joint: level, of: {joint_3: -1.0}}", "{joint: level, of: {elbow: -1.0}}\n  - {joint: level, of: {joint_3: 1}}",
         ["E-ROBOT-065", "level"]),
        ("motors: [joint_1, joint_2, joint_3, joint_4]", "", ["E-ROBOT-075", "joint_1, joint_2, joint_3, joint_4"]),
        ("motors: [joint_1, joint_2, joint_3, joint_4]", "motors: [joint_1, joint_2, elbow, joint_4]", ["E-ROBOT-074", "joint_3"]),
    ],
)  # fmt: skip
def test_relations_that_cannot_be(run, tmp_path: Path, right: str, wrong: str, refusal: list[str]) -> None:
    robot = write_robot(tmp_path, mimic=False)
    text = robot.read_text().replace("joint: level, of: {joint_3: -1.0}", "joint: level, of: {joint_3: -1.0}")
    assert right in text
    robot.write_text(text.replace(right, wrong).replace("{level: -1.0}", "{level: -1.0}"))
    if refusal[0] == "E-ROBOT-066":
        robot.write_text(robot.read_text().replace("of: {joint_3: -1.0}", "of: {elbow: -1.0}"))
    outcome = run("verify", robot, tmp_path / "points.csv")
    assert outcome.status == 2
    assert_refusal(outcome.err, *refusal)


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """What `verify` says of fresh points of one palletiser."""
    robot, true = write_robot(folder / str(seed), mimic=seed % 2 == 0), Palletiser.drawn(100 + seed)
    rng = np.random.default_rng(seed)
    q, fresh = poses(70, rng), poses(60, rng)
    points = write_points(robot.parent / "points.csv", q, true.measured(q, rng))
    checked = write_points(robot.parent / "checked.csv", fresh, true.measured(fresh, rng))
    return prediction_of(robot, points, checked, *KINEMATIC)


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """95 % intervals of fresh points, of 20 palletisers whose springs are known to 30 % only."""
    assert_intervals_cover(over_seeds(predicted, range(20), tmp_path))
