"""Fits to most of the poses of another fit are in its frame: what depends on the choice of frame alone does not scatter with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexcal.calibration.fit import base_errors
from flexcal.data.poses import read_poses
from flexcal.jobs.calibration import Fits, FitSettings
from flexcal.model.robot import RobotModel

UR5 = Path(__file__).parent.parent.parent / "examples" / "ur5_tracker"
TURNS = [f"station.tracker.{key}" for key in ("rx", "ry", "rz")]
SETTINGS = FitSettings(("kinematic",), "squares", 0.0, "reestimated")


@pytest.mark.parametrize("seed", [0, 1])
def test_most_of_the_poses_are_fitted_in_the_frame_of_all(seed: int) -> None:
    model = RobotModel.from_yaml(UR5 / "robot.yaml", estimates=False)
    rng = np.random.default_rng(seed)
    # a robot far from its nominal: registration alone, through its errors, depends on the poses
    joint = [j.name for j in model.joints][1]
    wrong = {f"{joint}.offset": 0.01, f"{joint}.misalignment_1": -0.01}
    assert not set(wrong) & set(base_errors(model))
    poses = read_poses(UR5 / "grid.csv", model).subset(rng.permutation(1000)[:60])
    model = model.with_values({name: model.value(name) + change for name, change in wrong.items()})
    every = Fits.of(model, poses, SETTINGS)
    whole, part = every.selected, Fits.of(model, poses.subset(slice(0, 50)), SETTINGS, near=every).selected
    assert [part.model.value(name) for name in TURNS] == [whole.model.value(name) for name in TURNS]
    assert part.identifiability.kept_names == whole.identifiability.kept_names
    for name in (*base_errors(model), "station.tracker.x", "station.tracker.y"):
        std = part.estimate.std(name)
        if std is not None:
            assert abs(part.estimate.values[name] - whole.estimate.values[name]) < 3 * std, name
