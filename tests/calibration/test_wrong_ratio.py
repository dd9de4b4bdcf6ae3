"""A joint of a UR5 that moves by another ratio than its file says, by an own kinematic model: found, though waves follow it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from test_filter import true_robot

from flexcal import Calibration, RobotModel, calibrate, read_poses

_MIDDLE = np.array([0.0, -1.3, 1.8, -1.8, -1.5, 0.0])


def calibrated(
    folder: Path, examples: Path, seed: int, turned: np.ndarray, wave: float, relation: str = ""
) -> Calibration:
    """Calibration with default options of a robot whose joints turn `turned` times as far, the elbow with a wave of `wave` rad."""
    folder.mkdir(exist_ok=True)
    shutil.copy(examples / "ur5_tracker" / "ur5.urdf", folder)
    declared = "robot: ur5.urdf\npoints:\n  smr: {frame: tool0, xyz: [0, 0, 0.031]}\n" + relation
    (folder / "robot.yaml").write_text(declared, "utf-8")
    arm, rng = true_robot(seed), np.random.default_rng(seed)
    rows = ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
    for k in range(80):
        q = _MIDDLE + rng.uniform(-0.8, 0.8, 6)
        real = turned * q + np.array([0, 0, wave * np.sin(2 * q[2]), 0, 0, 0])
        at = arm.tool(real)[:3, 3] + rng.normal(0, 1.5e-5, 3)
        rows.append(",".join([str(k), *map(repr, q.tolist()), *map(repr, at.tolist())]))
    (folder / "points.csv").write_text("\n".join(rows) + "\n", "utf-8")
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    return calibrate(model, read_poses(folder / "points.csv", model))


@pytest.mark.parametrize(("joint", "ratio"), [(2, 1.01), (1, 0.99), (4, 1.01), (2, 1.002)])
def test_a_wrong_ratio_is_named(tmp_path: Path, examples: Path, joint: int, ratio: float) -> None:
    """The sentence has the relation to declare, with which the robot is as accurate and to be trusted."""
    turned = np.where(np.arange(6) == joint, ratio, 1.0)
    wrong = calibrated(tmp_path / "wrong", examples, 3, turned, 0.0)
    assert wrong.coupling is not None and wrong.is_implausible
    name = wrong.nominal.joint_names[joint]
    assert (wrong.coupling.joint, wrong.coupling.other) == (name, name)
    assert wrong.coupling.ratio == pytest.approx(ratio, abs=3e-4)
    assert wrong.document()["verdict"]["trusted"] is False
    relation = wrong.coupling.declaration.strip("`") + "\n"
    right = calibrated(tmp_path / "right", examples, 3, turned, 0.0, relation)
    assert right.coupling is None and right.document()["verdict"]["trusted"] is True
    assert right.rigid.errors.mean < 3e-5


@pytest.mark.parametrize("seed", [1, 2])
def test_a_large_wave_is_no_ratio(tmp_path: Path, examples: Path, seed: int) -> None:
    """Two waves a turn of 2 mrad, as of an eccentric gear."""
    assert calibrated(tmp_path, examples, seed, np.ones(6), 2e-3).coupling is None
