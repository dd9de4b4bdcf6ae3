"""Groups that are left out are predicted by the terms that the calibration has, not by those that the rest of the poses would support."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.measurement import predict_measurements
from tests.jobs.yielding_robot import TX90L_LIKE, YieldingRobot, write_robot


def test_parts_of_the_poses_have_the_terms_of_all(tmp_path: Path) -> None:
    """As calibrations of each part with the terms of the whole; a part of 18 poses alone supports fewer."""
    model = RobotModel.from_yaml(write_robot(tmp_path, TX90L_LIKE))
    rng = np.random.default_rng(5)
    robot = YieldingRobot(TX90L_LIKE, np.abs(rng.normal(0, 6e-6, (6, 3))), rng)
    poses = read_poses(robot.write(tmp_path / "p.csv", 72), model)
    part = np.where(np.arange(72) % 4, "a", "b")
    whole = calibrate(model, poses, hold_out=("part", part))
    assert whole.held_out is not None
    assert "lateral_compliance" in whole.selected.terms
    own = calibrate(model, poses.subset(part == "b")).selected
    assert "lateral_compliance" not in own.terms
    for name, rest in (("a", "b"), ("b", "a")):
        left = poses.subset(part == name)
        fit = calibrate(model, poses.subset(part == rest), terms=list(whole.selected.terms))
        error = np.linalg.norm(left.position - predict_measurements(fit.model, left).position, axis=1).mean()
        assert abs(whole.held_out.groups[name].errors.mean / error - 1) < 0.1
