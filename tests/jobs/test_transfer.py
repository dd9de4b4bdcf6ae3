"""Calibrations on a part of every joint's range hold in the rest: gears that err roughly, of a simulator that shares no code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from yielding_robot import UR_LIKE, YieldingRobot, write_robot

from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.verification import prediction_errors

_ORDERS = np.arange(1, 41)


class RoughGears(YieldingRobot):
    """Every joint is off by waves of 40 orders, 60 µrad over the order each, and the arm by what no model has: 20 µm within centimetres."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        compliance = np.zeros((6, 3))
        compliance[:, 2] = 5e-6
        super().__init__(UR_LIKE, compliance, rng)
        self.waves = rng.normal(0.0, 6e-5, (6, 2, len(_ORDERS))) / _ORDERS
        self.ripple = rng.normal(0.0, 12.0, (6, 6))

    def point(self, q: np.ndarray) -> np.ndarray:
        turned = np.outer(q, _ORDERS)
        moved = q + np.sum(self.waves[:, 0] * np.sin(turned) + self.waves[:, 1] * np.cos(turned), axis=1)
        return super().point(moved) + 2e-5 * np.sin(self.ripple @ q)[:3]


def in_part(robot: RoughGears, count: int, *, outside: bool) -> np.ndarray:
    """Poses (count, 6) in the middle 90° of every joint, or in the 45° before and behind."""
    middle = np.array([np.mean(body.limits) for body in robot.bodies])
    away = robot.rng.uniform(-1.0, 1.0, (count, 6)) * np.pi / 4
    return middle + away + (np.sign(away) * np.pi / 4 if outside else 0.0)


def p90_over_geometry(seed: int, folder: Path) -> tuple[float, float, float]:
    """P90 outside and inside over that of the geometry alone, and observed over predicted errors outside."""
    robot = RoughGears(seed)
    folder.mkdir()
    model = RobotModel.from_yaml(write_robot(folder, UR_LIKE), estimates=False)
    poses = read_poses(robot.write_at(folder / "fit.csv", in_part(robot, 150, outside=False)), model)
    placed = model.with_stations(poses.places)
    fresh = [
        read_poses(robot.write_at(folder / f"{outside}.csv", in_part(robot, 150, outside=outside)), placed)
        for outside in (True, False)
    ]
    found = []
    for terms in (("kinematic", "gravity_compliance"), None):
        own = calibrate(model, poses, terms=terms).model
        errors = [prediction_errors(own, each) for each in fresh]
        found.append([each.all.p90 for each in errors])
    ratio = np.sqrt(np.sum(errors[0].errors ** 2) / np.sum(errors[0].expected_rms ** 2))
    return found[1][0] / found[0][0], found[1][1] / found[0][1], float(ratio)


@pytest.mark.slow
def test_random_waves_do_not_run_off_outside(tmp_path: Path) -> None:
    outside, inside, ratio = np.array([p90_over_geometry(seed, tmp_path / str(seed)) for seed in range(6)]).T
    assert np.median(outside) < 1.1 and outside.max() < 1.5
    assert np.median(inside) < 1.0
    assert np.median(ratio) < 1.5
