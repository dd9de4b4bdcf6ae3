"""A robot whose URDF has no masses, as many drawings have none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexcal.data.plans import PosePlan
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, VirtualCell


def test_it_is_measured_where_its_kinematics_have_it(examples: Path) -> None:
    nominal = RobotModel.from_yaml(examples / "irb120_program" / "robot.yaml", estimates=False)
    assert not nominal.links.mass.any()
    cell, truth = VirtualCell.drawn(nominal, CellConfig(), 3)
    q = np.random.default_rng(1).uniform(-0.5, 0.5, (5, nominal.n))
    expected = point_kinematics(nominal.with_values(truth), q).position
    seen = cell.noise_free(PosePlan(q=q))
    for k in range(1, 5):  # wherever the instrument stands
        assert np.linalg.norm(seen[k] - seen[0]) == pytest.approx(
            np.linalg.norm(expected[k] - expected[0]), abs=1e-9
        )
