"""Points in another unit that lie within reach of the instrument, of an arm that shares nothing with flexcal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_poses, write_robot
from refusals import refused

from flexcal import RobotModel, read_poses


def _written(folder: Path, count: int, metres: float) -> tuple[RobotModel, Path]:
    """A file of `count` points in a unit of so many metres, and the robot, whose reflector is declared a decimetre from where it is."""
    rng = np.random.default_rng(count)
    robot = write_robot(folder)
    robot.write_text(robot.read_text().replace("[0.03, -0.02, 0.11]", "[0.0, 0.0, 0.0]"))
    q = postures(rng, count)
    points = tracked(DHArm.made(3).points(q), rng, 3e-5)
    return RobotModel.from_yaml(robot, estimates=False), write_poses(
        folder / "p.csv", q, points / metres, None
    )


@pytest.mark.parametrize("count", [5, 10, 40])
def test_feet_are_noticed(tmp_path: Path, count: int) -> None:
    model, file = _written(tmp_path, count, 0.3048)
    with refused("E-POSES-082", "feet"):
        read_poses(file, model)


@pytest.mark.parametrize("metres", [1.0, 0.9144])
@pytest.mark.parametrize("count", [5, 40])
def test_metres_are_not_doubted(tmp_path: Path, count: int, metres: float) -> None:
    """Nor what is as near to them as yards, which the size of a few points does not tell."""
    model, file = _written(tmp_path, count, metres)
    assert len(read_poses(file, model)) == count
