"""A robot that touches a ball in its other hand, and a probe there, both with a declared place on the hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from touching_arms import DECLARED, RADIUS, TouchingArms

from flexcal import Calibration, PoseSet, RobotModel, calibrate, read_poses, verify
from flexcal.calibration.fit import geometric_parameters
from flexcal.calibration.measurement import predict_measurements
from flexcal.design.scene import station_position

BALL = "measurements: {ball: {kind: sphere, std: 2.0e-5}}\n"
PLACED = (
    f"stations: {{tracker: {{xyz: [2, 0, 1]}}, ball: {{frame: left_hand, xyz: {DECLARED.tolist()}}}, "
    "probe: {frame: left_hand, xyz: [0.01, -0.02, 0.03]}}\n"
)


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory) -> tuple[TouchingArms, Path, RobotModel, Calibration]:
    robot, folder = TouchingArms(1, joints=5, waist=False, yields=0.0), tmp_path_factory.mktemp("touched")
    model = RobotModel.from_yaml(robot.write(folder, BALL + PLACED), estimates=False)
    poses = read_poses(robot.write_touches(folder / "touches.csv", 160, np.random.default_rng(1)), model)
    return robot, folder, model, calibrate(model, poses, terms=["kinematic"])


def test_the_ball_and_the_arms_are_found(
    touched: tuple[TouchingArms, Path, RobotModel, Calibration],
) -> None:
    """Distances of tip and ball at any postures, which were millimetres off, are met to a fiftieth, and the ball is in its interval."""
    robot, _, model, calibration = touched
    q = robot.postures(300, np.random.default_rng(2))
    true = np.linalg.norm(robot.ball_at(q) - robot.reflector(q, "right"), axis=1)
    anywhere = PoseSet.unmeasured(q, "right", "ball")
    before, after = (
        np.sqrt(np.mean((np.linalg.norm(predict_measurements(m, anywhere).located, axis=1) - true) ** 2))
        for m in (model, calibration.model)
    )
    assert before > 3e-3 and after < 0.02 * before
    assert calibration.model.value("station.ball.zero") == pytest.approx(RADIUS, abs=5e-6)
    for axis, key in enumerate("xyz"):
        # the station's numbers are where the declared place is, seen from the ball
        found = DECLARED[axis] - calibration.model.value(f"station.ball.{key}")
        std = calibration.estimate.std(f"station.ball.{key}")
        assert std is not None and abs(found - robot.ball[axis]) < 3 * std < 3e-3


def test_the_place_on_the_hand_is_where_readings_count_from(
    touched: tuple[TouchingArms, Path, RobotModel, Calibration], tmp_path: Path
) -> None:
    """By the simulator's own nominal arms; the same ball is found where only the hand is declared."""
    robot, folder, model, calibration = touched
    q = robot.postures(20, np.random.default_rng(3))
    rotation, position = robot.tool(q, "left", true=False)
    away = robot.reflector(q, "right", true=False) - position - rotation @ DECLARED
    located = predict_measurements(model, PoseSet.unmeasured(q, "right", "ball"), elastic=False).located
    np.testing.assert_allclose(located, np.einsum("sji,sj->si", rotation, away), atol=1e-12)
    unplaced = PLACED.replace(f", xyz: {DECLARED.tolist()}", "")
    other = RobotModel.from_yaml(robot.write(tmp_path, BALL + unplaced), estimates=False)
    again = calibrate(other, read_poses(folder / "touches.csv", other), terms=["kinematic"])
    for axis, key in enumerate("xyz"):
        name = f"station.ball.{key}"
        assert again.model.value(name) == pytest.approx(
            calibration.model.value(name) - DECLARED[axis], abs=1e-7
        )


def test_derivatives_are_those_of_differences(tmp_path: Path) -> None:
    """Of contacts and of readings of the probe, by every parameter of both arms, the compliances and the places on the hand."""
    robot, rng = TouchingArms(1, joints=4), np.random.default_rng(0)
    springs = "elastic:\n  - {joint: left_shoulder_pitch, drive: {stiffness: 9e3, damping: 1}}\n"
    model = RobotModel.from_yaml(robot.write(tmp_path, BALL + PLACED + springs), estimates=False)
    touches = replace(
        PoseSet.unmeasured(robot.postures(15, rng), "right", "ball"), kind=np.full(15, "distance")
    )
    for poses in (touches, PoseSet.unmeasured(robot.postures(15, rng), "right", "probe")):
        names = geometric_parameters(
            model, poses, ["kinematic", "gravity_compliance", "lateral_compliance"]
        ).names
        assert "left_elbow.offset" in names and f"station.{poses.stations[0]}.x" in names
        changed = model.with_values({n: 1e-3 * rng.normal() for n in names if "compliance" not in n})
        jacobian = predict_measurements(changed, poses, jacobians=True).jacobian(names)
        for k, name in enumerate(names):
            step = 1e-6 if "compliance" in name else 1e-4
            up, down = (
                predict_measurements(changed.with_values({name: changed.value(name) + h}), poses).residual
                for h in (step, -step)
            )
            expected = (down - up) / (2 * step)
            assert jacobian[:, :, k] == pytest.approx(expected, abs=2e-3 * np.abs(expected).max() + 1e-6), (
                name
            )


def test_a_probe_on_the_hand_verifies(
    touched: tuple[TouchingArms, Path, RobotModel, Calibration],
) -> None:
    """What contacts calibrated, with the probe placed by its readings; and what the probe itself calibrated, without."""
    robot, folder, model, calibration = touched
    rng = np.random.default_rng(4)
    fresh = read_poses(robot.write_relative(folder / "fresh.csv", 80, rng), model)
    placed = verify(calibration.robot, fresh, refit=["station"])
    assert placed.document()["prediction"]["verdict"] in ("right", "unknown")
    assert placed.before.own is not None
    assert placed.errors.mean < 0.12 * np.linalg.norm(placed.before.own, axis=1).mean()
    poses = read_poses(robot.write_relative(folder / "probe.csv", 80, rng), model)
    found = verify(calibrate(model, poses, terms=["kinematic"]).robot, fresh)
    assert found.trust.status == "good", found.trust.sentence
    assert found.errors.mean < 1.3 * 5e-5 * np.sqrt(8 / np.pi)


def test_a_place_on_the_hand_is_none_in_the_base_frame(tmp_path: Path) -> None:
    robot = TouchingArms(1, joints=4)
    model = RobotModel.from_yaml(robot.write(tmp_path, BALL + PLACED), estimates=False)
    assert station_position(model, "ball") is None
    np.testing.assert_allclose(station_position(model, "tracker"), [2, 0, 1])
    with refused("E-ROBOT-061", "robot.yaml", "ball", "left_hand"):
        both = BALL.replace("sphere,", "sphere, xyz: [0.4, 0, 1],") + PLACED
        RobotModel.from_yaml(robot.write(tmp_path, both), estimates=False)
    with refused("E-ROBOT-020"):
        sight = PLACED.replace("left_hand, xyz", "left_hand, line_of_sight: true, xyz")
        RobotModel.from_yaml(robot.write(tmp_path, BALL + sight), estimates=False)
