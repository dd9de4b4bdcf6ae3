"""A robot that differs from the nominal TX90L in everything that moves the tool, and targets for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flexcal.data.poses import ToolTargets
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import GEOMETRY, RobotModel


@pytest.fixture(scope="session")
def real(tx90l: RobotModel) -> RobotModel:
    """Lengths off by 0.3 mm, angles by 0.5 mrad, gaps, other springs and masses, a payload that weighs more than declared."""
    rng = np.random.default_rng(7)
    values = {"payload.mass": 6.4, "joint_2.backlash": 4e-5, "joint_3.backlash": 3e-5}
    values |= {"joint_4.transmission_2_sin": 1e-4, "joint_5.gravity_compliance": 1e-6}
    for owner in (*tx90l.joint_names, "tool"):
        values |= {f"{owner}.{key}": (3e-4 if "length" in key else 5e-4) * rng.normal() for key in GEOMETRY}
    values |= {f"station.tracker.{key}": v for key, v in zip("xyz", (0.4, -1.2, 0.3), strict=True)}
    values |= {f"station.tracker.r{key}": v for key, v in zip("xyz", (0.1, 0.2, -2.0), strict=True)}
    for name, value in tx90l.values.items():
        if name.endswith((".stiffness", ".mass")) and name != "payload.mass":
            values[name] = value * np.exp(0.15 * rng.normal())
    return tx90l.with_values(values)


@pytest.fixture
def random_targets(tx90l: RobotModel, rng: np.random.Generator) -> Callable[[int], ToolTargets]:
    """random_targets(count): nominal commands all over the joint ranges, with payloads of 0 to 6 kg."""

    def draw(count: int) -> ToolTargets:
        return ToolTargets(
            pose=np.arange(count),
            target=np.full(count, "smr"),
            q=rng.uniform(*joint_ranges(tx90l), (count, tx90l.n)),
            payload=rng.uniform(0, 6, count),
        )

    return draw
