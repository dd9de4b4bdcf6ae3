"""A standard deviation in a file cannot be less than its digits carry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal import RobotModel, read_poses
from flexcal.data.poses import last_digit


def test_the_last_digit_of_numbers() -> None:
    values = np.random.default_rng(1).uniform(-2, 2, (200, 3))
    for decimals in (1, 3, 6, 9, 12):
        rounded = np.round(values, decimals)
        assert last_digit(rounded) == pytest.approx(10.0**-decimals)
        in_millimetres = np.array([float(f"{1e3 * value:.{decimals}f}") for value in values.ravel()])
        assert last_digit(1e-3 * in_millimetres[:, None]) == pytest.approx(10.0 ** -(decimals + 3))
    assert last_digit(values) < 1e-14
    assert last_digit(np.array([[0.5], [0.25]])) < 1e-14, "too few to tell"


@pytest.mark.parametrize(
    ("decimals", "sigma", "said"),
    [
        (6, "1e-300", "end at 1e-06"),
        (6, "1e-12", "end at 1e-06"),
        (6, "2.8e-7", "end at 1e-06"),
        (6, "3e-7", ""),
        (5, "1e-6", "end at 1e-05"),
        (17, "1e-300", "no instrument"),
        (17, "1e-12", ""),
    ],
)
def test_a_noise_below_the_digits_is_refused(
    ur5: RobotModel, tmp_path: Path, decimals: int, sigma: str, said: str
) -> None:
    rng = np.random.default_rng(2)
    file = tmp_path / "poses.csv"
    lines = ["pose,q1,q2,q3,q4,q5,q6,x,y,z,sigma"]
    for pose in range(30):
        numbers = [f"{q:.6f}" for q in rng.uniform(-1, 1, 6)] + [
            f"{x:.{decimals}f}" for x in rng.uniform(-0.5, 0.5, 3)
        ]
        lines.append(",".join([str(pose), *numbers, sigma]))
    file.write_text("\n".join(lines))
    if said:
        with refused("E-POSES-083", "line 2, column sigma", said):
            read_poses(file, ur5)
    else:
        assert read_poses(file, ur5).sigma_given


def test_a_noise_of_tilts_below_their_digits_is_refused(examples: Path, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        f"robot: {examples / 'ur5_tracker' / 'ur5.urdf'}\nmeasurements: {{level: {{kind: inclinometer, frame: tool0}}}}\n"
    )
    model = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    rng = np.random.default_rng(3)
    for sigma in ("-1e-4", "1e-300", "1e-9"):
        rows = [
            [*rng.uniform(-1, 1, 6).round(6), *rng.uniform(-0.5, 0.5, 2).round(5), sigma] for _ in range(30)
        ]
        lines = [",".join(map(str, row)) for row in rows]
        file = tmp_path / "tilts.csv"
        file.write_text("\n".join(["q1,q2,q3,q4,q5,q6,tilt_x,tilt_y,sigma_angle", *lines]))
        with refused("E-POSES-011" if sigma[0] == "-" else "E-POSES-083", "line 2, column sigma_angle"):
            read_poses(file, model)
