"""A stranger's arm that a crank and a rod lift: its loop closes as circles intersect, is identified from points and compensated."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import four_bar_arm
import numpy as np
import pinocchio as pin
import pytest
from arm_points import write_points
from four_bar_arm import DRIVES, FourBarArm, poses, write_robot
from palletiser import turn
from refusals import assert_refusal

from flexcal import fit_geometry, read_poses, tool_at_rest
from flexcal.calibration.measurement import predict_measurements
from flexcal.model.kinematics import joint_motion, joint_positions
from flexcal.model.robot import GEOMETRY, RobotModel

ERRORS = [*(f"loop.four_bar.b_{axis}" for axis in "xyz"), *(f"arm_joint.origin_{axis}" for axis in "xyz")]
"""Where the pin is on the arm, which carries the forearm too, and where the arm turns in the column, which carries the crank too."""


def _wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def test_the_loop_closes_as_circles_intersect(tmp_path: Path) -> None:
    """Over the crank's whole range, and with the load of the arm on its motor."""
    model = RobotModel.from_yaml(write_robot(tmp_path))
    true = FourBarArm.nominal()
    q = poses(40, np.random.default_rng(0))
    raised = joint_positions(model, q)[:, model.joint_index("arm_joint")]
    np.testing.assert_allclose(_wrapped(raised - true.arm_angle(q[:, 1])), 0, rtol=0, atol=1e-11)
    true = replace(true, drives=DRIVES)
    at = tool_at_rest(model, q, None, np.full(len(q), "smr"), jacobians=True)
    np.testing.assert_allclose(at.kinematics.position, true.reflector(q), rtol=0, atol=1e-10)
    assert np.abs(at.rest.deflection[:, model.joint_index("joint_2"), 2]).max() > 2e-3
    steps = 1e-5 * np.eye(4)
    slopes = np.stack([(true.reflector(q + e) - true.reflector(q - e)) / 2e-5 for e in steps], axis=2)
    np.testing.assert_allclose(at.command_jacobian()[:, :3], slopes, rtol=0, atol=2e-8)


def test_the_loop_is_pinocchios_constraint(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path))
    q = poses(5, np.random.default_rng(1))
    still = np.zeros((5, len(model.joints), 3))
    motion = joint_motion(model, q, still, derivatives=True)
    read = pin.buildModelFromUrdf(str(model.urdf))
    data = read.createData()
    ends = [read.frames[read.getFrameId(name)] for name in ("rod_end", "arm_pin")]
    constraint = pin.RigidConstraintModel(
        pin.ContactType.CONTACT_3D,
        read,
        ends[0].parentJoint,
        ends[0].placement,
        ends[1].parentJoint,
        ends[1].placement,
        pin.LOCAL_WORLD_ALIGNED,
    )
    state = constraint.createData()
    order = [read.joints[read.getJointId(name)].idx_v for name in model.joint_names]
    passive = [model.joint_index(name) for name in ("rod_joint", "arm_joint")]
    for k in range(len(q)):
        at = np.zeros(read.nq)
        at[order] = (motion.q + motion.deflection[:, :, 2])[k]
        pin.computeJointJacobians(read, data, at)
        pin.updateFramePlacements(read, data)
        gap = (
            data.oMf[read.getFrameId("rod_end")].translation
            - data.oMf[read.getFrameId("arm_pin")].translation
        )
        np.testing.assert_allclose(gap, 0, rtol=0, atol=1e-11)
        constraint.calc(read, data, state)
        held = pin.getConstraintJacobian(read, data, constraint, state)[:, order]
        motors = list(model.motors)
        theirs = -np.linalg.pinv(held[:, passive]) @ held[:, motors]
        ours = motion.by_motion[k][passive][:, [3 * i + 2 for i in motors]]
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)


def test_the_jacobian_is_that_of_finite_differences(tmp_path: Path) -> None:
    """Through the closure and what its ratios do to the load, for errors of links beside the chain to the tool too."""
    nominal, rng = RobotModel.from_yaml(write_robot(tmp_path)), np.random.default_rng(2)
    names = [*(f"{joint}.{key}" for joint in nominal.joint_names for key in GEOMETRY), *ERRORS]
    model = nominal.with_values({name: 1e-3 * rng.normal() for name in names})
    q = poses(4, rng)
    measured = read_poses(write_points(tmp_path / "p.csv", q, FourBarArm.nominal().reflector(q)), model)
    names += ["arm.mass", "rod.mass", "rod.com_x", "crank.com_x", "joint_2.drive.stiffness"]
    exact = predict_measurements(model, measured, jacobians=True).jacobian(names)
    for k, name in enumerate(names):
        value = model.value(name)
        step = 1e-4 if "com" in name else 1e-6 * max(1.0, abs(value))
        ends = [
            predict_measurements(model.with_values({name: value + s}), measured).position
            for s in (step, -step)
        ]
        slope = (ends[0] - ends[1]) / (2 * step)
        scale = max(float(np.abs(slope).max()), 1e-4)
        np.testing.assert_allclose(exact[:, :, k] / scale, slope / scale, rtol=0, atol=2e-5, err_msg=name)


def test_without_noise_the_fit_predicts_exactly(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path))
    true = replace(FourBarArm.drawn(1), drives=DRIVES, lean=np.zeros(3))
    rng = np.random.default_rng(3)
    q, fresh = poses(40, rng), poses(30, rng)
    here = read_poses(write_points(tmp_path / "points.csv", q, true.reflector(q)), model)
    fit = fit_geometry(model, here, terms=("kinematic",))
    there = read_poses(write_points(tmp_path / "fresh.csv", fresh, true.reflector(fresh)), model)
    assert np.abs(predict_measurements(fit.model, there).residual).max() < 1e-6
    # a loop in a plane has no measure across it, and what holds a passive joint is the loop, not its zero
    dropped = {item.name: item.absorbed_by for item in fit.identifiability.dropped}
    for name in ("loop.four_bar.b_y", "joint_2.length_y", "rod_joint.offset", "arm_joint.offset"):
        assert dropped[name] == (), name


@pytest.mark.slow
def test_calibrated_verified_compensated(run, tmp_path: Path) -> None:
    robot, true, rng = write_robot(tmp_path), FourBarArm.drawn(4), np.random.default_rng(4)
    q, fresh = poses(60, rng), poses(40, rng)
    points = write_points(tmp_path / "points.csv", q, true.measured(q, rng))
    checked = write_points(tmp_path / "checked.csv", fresh, true.measured(fresh, rng))
    assert run("calibrate", robot, points, "--terms", "kinematic").status == 0
    errors = run("verify", robot, checked, "--json").document["verification"]
    assert errors["measured"]["mean_mm"] < 0.06 and errors["nominal"]["mean_mm"] > 1.0, errors
    stand = (turn(2, -2.1) @ turn(1, 0.02))[0]
    wanted = FourBarArm.nominal().reflector(0.85 * poses(20, rng)) @ stand.T + [2.4, -0.3, 0.8]
    lines = [f"{i + 1},{x!r},{y!r},{z!r},tracker" for i, (x, y, z) in enumerate(wanted.tolist())]
    (tmp_path / "targets.csv").write_text("\n".join(["pose,x,y,z,station", *lines, ""]))
    outcome = run("compensate", robot, tmp_path / "targets.csv", "--out", tmp_path / "commands.csv")
    assert outcome.status == 0, outcome.err
    with (tmp_path / "commands.csv").open() as stream:
        rows = {
            int(row["pose"]): [float(row[f"q{k}"]) for k in range(1, 5)] for row in csv.DictReader(stream)
        }
    assert len(rows) >= 15
    kept = np.array(sorted(rows)) - 1
    reached = true.reflector(np.array([rows[i + 1] for i in kept])) @ stand.T + [2.4, -0.3, 0.8]
    assert np.linalg.norm(reached - wanted[kept], axis=1).mean() < 0.06e-3
    exported = run("export", "urdf", robot, "--out", tmp_path / "found.urdf")
    assert exported.status == 0 and "four_bar" in exported.out and "rod_joint and arm_joint" in exported.out


def test_a_loop_that_cannot_close(run, tmp_path: Path) -> None:
    """A rod drawn 30 mm too long leaves the pin behind the crank's highest positions; one of half the length, everywhere."""
    q = poses(30, np.random.default_rng(5))
    xyz = FourBarArm.nominal().reflector(q)
    robot = write_robot(tmp_path, rod=four_bar_arm.ROD_END * 1.45)
    short = replace(FourBarArm.nominal(), rod=float(np.linalg.norm(four_bar_arm.ROD_END)) * 1.45)
    open_ = np.isnan(short.arm_angle(q[:, 1]))
    assert 0 < open_.sum() < len(q)
    outcome = run("calibrate", robot, write_points(tmp_path / "points.csv", q, xyz))
    assert outcome.status == 2
    line = 2 + int(np.argmax(open_))
    assert_refusal(
        outcome.err, "E-TABLE-041", f"points.csv line {line}, column q1", "four_bar", "joint_2 at", "mm apart"
    )


@pytest.mark.parametrize(
    ("right", "wrong", "refusal"),
    [
        ("a: rod_end", "a: rod_ende", ["E-ROBOT-070", "line", "rod_ende", "rod_end"]),
        ("rod_joint: 0.1", "joint_3: 0.1", ["E-ROBOT-071", "joint_3", "rod_end", "arm_pin"]),
        (", arm_joint: -0.1", "", ["E-ROBOT-064", "1"]),
        ("motors: [joint_1, joint_2, joint_3, joint_4]", "relations: [{joint: rod_joint, of: {joint_2: -1}}]",
         ["E-ROBOT-067", "rod_joint"]),
    ],
)  # fmt: skip
def test_loops_that_cannot_be(run, tmp_path: Path, right: str, wrong: str, refusal: list[str]) -> None:
    robot = write_robot(tmp_path)
    text = robot.read_text()
    assert right in text
    robot.write_text(text.replace(right, wrong))
    outcome = run("verify", robot, tmp_path / "points.csv")
    assert outcome.status == 2
    assert_refusal(outcome.err, *refusal)
