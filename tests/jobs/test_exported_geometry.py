"""Exported robots against the arms themselves: a simulator that shares nothing with flexcal, and the points that a tracker saw of a UR5."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from yielding_robot import TX90L_LIKE, YieldingRobot, write_robot

from flexcal import RobotModel, calibrate, export_robot, read_poses
from flexcal.export.representation_error import tool_positions
from flexcal.export.urdf import render_urdf
from flexcal.model.robot.config import BoxConfig
from flexcal.units import MILLIMETRE


class WavyRobot(YieldingRobot):
    """Every joint yields to gravity about its axis, and its gear is off by a wave once a turn."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        compliance = np.zeros((6, 3))
        compliance[:, 2] = rng.uniform(1e-6, 3e-6, 6)
        super().__init__(TX90L_LIKE, compliance, rng)
        self.waves = rng.normal(0.0, 2e-4, (2, 6))

    def pose(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reflector in the base's frame, and the axes of the last link."""
        moved = q + self.waves[0] * np.sin(q) + self.waves[1] * np.cos(q)
        bend = np.zeros((6, 3))
        for _ in range(6):
            bend = self.compliance * self._moments(*self._frames(moved, bend))
        turns, origins = self._frames(moved, bend)
        return origins[5] + turns[5] @ self.reflector, turns[5]

    def point(self, q: np.ndarray) -> np.ndarray:
        return self.pose(q)[0]


def by_pinocchio(urdf: str, point: str, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) and axes (N, 3, 3) of a link."""
    read = pin.buildModelFromXML(urdf)
    data, frame = read.createData(), read.getFrameId(point)
    positions, turns = [], []
    for row in q:
        pin.framesForwardKinematics(read, data, row)
        positions.append(data.oMf[frame].translation.copy())
        turns.append(data.oMf[frame].rotation.copy())
    return np.array(positions), np.array(turns)


def distances(found: np.ndarray, turns: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Distances (N,), m, of points after the best base and the best place of the point on the tool, whose axes are `turns`."""
    place, base, shift = np.zeros(3), np.eye(3), np.zeros(3)
    for _ in range(30):
        points = found + turns @ place
        u, _, v = np.linalg.svd((true - true.mean(axis=0)).T @ (points - points.mean(axis=0)))
        base = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
        shift = true.mean(axis=0) - base @ points.mean(axis=0)
        missing = true - points @ base.T - shift
        place = place + np.linalg.lstsq((base @ turns).reshape(-1, 3), missing.ravel(), rcond=None)[0]
    return np.linalg.norm(true - (found + turns @ place) @ base.T - shift, axis=1)


def angles(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Angles (N,), rad, between axes (N, 3, 3), after the best turns of base and tool."""
    off = Rotation.from_matrix(found @ np.swapaxes(true, 1, 2)).as_rotvec()
    columns = np.concatenate([np.broadcast_to(np.eye(3), true.shape), true], axis=2).reshape(-1, 6)
    left = off.ravel() - columns @ np.linalg.lstsq(columns, off.ravel(), rcond=None)[0]
    return np.linalg.norm(left.reshape(-1, 3), axis=1)


@pytest.mark.parametrize("seed", range(2))
def test_the_urdf_is_as_near_to_the_arm_as_said_and_nearer_than_the_geometry_alone(
    seed: int, tmp_path: Path
) -> None:
    arm = WavyRobot(seed)
    model = RobotModel.from_yaml(write_robot(tmp_path, TX90L_LIKE), estimates=False)
    poses = read_poses(arm.write(tmp_path / "poses.csv", 100), model)
    robot = calibrate(model, poses, terms=["kinematic", "gravity_compliance", "transmission"]).robot
    exported = export_robot(robot, tmp_path / "calibrated.urdf", "urdf")
    q, _ = arm.measured(200)
    true, axes = (np.array(part) for part in zip(*(arm.pose(row) for row in q), strict=True))
    texts = render_urdf(model).text, render_urdf(robot.probable).text, exported.path.read_text()
    read = [by_pinocchio(text, "smr", q) for text in texts]
    uncalibrated, plain, best = (distances(*each, true).mean() / MILLIMETRE for each in read)
    assert best < 0.9 * plain
    document = exported.document()
    assert best == pytest.approx(document["tool_error"]["mean_mm"], rel=0.15)
    assert uncalibrated == pytest.approx(document["nominal_error"]["mean_mm"], rel=0.15)
    turned = [angles(turns, axes).mean() for _, turns in read[1:]]
    assert turned[1] < turned[0]


def test_the_urdf_of_the_ur5_is_as_near_to_what_a_tracker_saw_as_said(examples: Path, tmp_path: Path) -> None:
    """At points of the grid that were not calibrated with; what is said for its volume lacks what the calibrated robot itself is off."""
    model = RobotModel.from_yaml(examples / "ur5_tracker" / "robot.yaml", estimates=False)
    poses = read_poses(examples / "ur5_tracker" / "grid.csv", model)
    calibrated = np.arange(len(poses)) % 4 == 0
    fresh = poses.subset(~calibrated)
    base = poses.position * [
        -1,
        -1,
        1,
    ]  # base_link to the UR controller's base frame, in which the points are
    volume = BoxConfig(tuple(base.min(axis=0)), tuple(base.max(axis=0)))
    declared = replace(model, config=replace(model.config, working_volume=volume))
    for nominal in (model, declared):
        robot = calibrate(nominal, poses.subset(calibrated)).robot
        exported = export_robot(robot, tmp_path / "calibrated.urdf", "urdf")
        read = by_pinocchio(exported.path.read_text(), "smr", fresh.q)
        seen = distances(*read, fresh.position).mean() / MILLIMETRE
        assert seen < 0.185
    own = distances(tool_positions(robot.probable, fresh.q)[0], read[1], fresh.position).mean() / MILLIMETRE
    said = exported.document()["tool_error"]
    assert "working volume" in said["within"] and np.hypot(said["mean_mm"], own) == pytest.approx(
        seen, rel=0.15
    )
