"""Estimates that were computed from another robot, or from other blocks, than are there now."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import provenance, write_estimates
from flexcal.jobs.inputs import CalibratedRobot, outdated_remarks
from flexcal.model.robot import DECLARED, RobotModel, declared_sha256


def test_a_block_of_another_robot_is_named(examples: Path, tmp_path: Path) -> None:
    """Only what changes the result counts: a comment does not."""
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(examples / "ur5_tracker" / name, tmp_path)
    robot, stored = tmp_path / "robot.yaml", tmp_path / "estimates.yaml"
    model = RobotModel.from_yaml(robot, estimates=False)
    origin = provenance([robot, model.urdf]) | {DECLARED: declared_sha256(model)}

    def estimate(name: str, unit: str, value: float) -> Estimate:
        parameters = Parameters([Parameter(name, unit, value)])
        return Estimate(
            parameters, np.eye(1), 1, (), (True,), 0.0, 0.0, 1, "converged", "", 1, provenance=origin
        )

    def remarks() -> tuple[str, ...]:
        return outdated_remarks(CalibratedRobot.from_yaml(robot))

    write_estimates(stored, "calibration", estimate("elbow_joint.offset", "rad", 0.001))
    text = robot.read_text()
    robot.write_text("# a comment\n" + text)
    assert remarks() == ()
    robot.write_text(text.replace("xyz: [0, 0, 0.031]", "xyz: [0, 0.001, 0.031]"))
    (said,) = remarks()
    assert "'calibration'" in said and "robot.yaml" in said and "'flexcal calibrate'" in said
    robot.write_text(text)
    write_estimates(stored, "stiffness", estimate("elbow_joint.drive.stiffness", "N m/rad", 1e5))
    (said,) = remarks()
    assert "another block 'stiffness'" in said and "robot.yaml" not in said
