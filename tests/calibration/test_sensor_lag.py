"""A temperature sensor that follows the arm late, by an arm that shares nothing with flexcal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_poses, write_robot
from thermal_arm import ThermalArm, cycling, sensed

from flexcal import Calibration, RobotModel, calibrate, read_poses

SIGMA = 2.5e-5


def _calibrated(folder: Path, lag: float, noise: float) -> Calibration:
    """An arm that warms up and cools down once in five hours, measured all the while."""
    rng = np.random.default_rng(11)
    time = np.arange(110) * 160.0
    warm = cycling(time, rise=14.0, period=17600.0)
    read = sensed(time, warm, rng, noise=noise, lag=lag)
    q = postures(rng, len(time))
    points = tracked(ThermalArm(DHArm.made(6)).points(q, warm), rng, SIGMA)
    file = write_poses(folder / "points.csv", q, points, SIGMA)
    lines = file.read_text().splitlines()
    columns = [
        "t,temperature",
        *(f"{t!r},{degrees!r}" for t, degrees in zip(time.tolist(), read.tolist(), strict=True)),
    ]
    file.write_text("\n".join(f"{line},{more}" for line, more in zip(lines, columns, strict=True)) + "\n")
    model = RobotModel.from_yaml(write_robot(folder), estimates=False)
    return calibrate(model, read_poses([file], model), terms=["kinematic", "thermal"])


@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_a_sensor_that_lags_is_told_with_its_time(tmp_path: Path, noise: float) -> None:
    document = _calibrated(tmp_path, 2400.0, noise).document()
    found = document["temperature"]["sensor_lag"]
    assert found["certain"] and found["unit"] == "s"
    assert abs(found["lag"] - 2400.0) < 0.25 * 2400.0
    assert any("lag behind those of the arm by" in remark for remark in document["remarks"])


def test_a_sensor_on_the_arm_has_none(tmp_path: Path) -> None:
    document = _calibrated(tmp_path, 0.0, 0.1).document()
    assert not document["temperature"]["sensor_lag"]["certain"]
    assert not any("those of the arm by" in remark for remark in document["remarks"])
