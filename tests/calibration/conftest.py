"""Simulated tracker measurements of a robot with known errors, made by the forward model alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import GEOMETRY, RobotModel


@dataclass(frozen=True, eq=False)
class Simulated:
    """A true robot and what a tracker saw of it."""

    truth: dict[str, float]
    robot: RobotModel
    poses: PoseSet


def random_truth(model: RobotModel, rng: np.random.Generator) -> dict[str, float]:
    """47 geometric errors of 0.3 mm and 0.5 mrad, half gaps of 0.02-0.05 mrad, masses ±7 %, centres of mass ±10 mm, stiffnesses ±15 %."""
    truth = {f"station.tracker.{k}": 3e-4 * rng.normal() for k in "xyz"}
    for owner in (*model.joint_names, "tool"):
        truth |= {f"{owner}.{key}": (3e-4 if "length" in key else 5e-4) * rng.normal() for key in GEOMETRY}
    truth |= {f"{model.joint_names[i]}.backlash": rng.uniform(2e-5, 5e-5) for i in model.backlash_joints}
    for name, value in model.values.items():
        if name.startswith("link_") and name.endswith(".mass"):
            truth[name] = value * np.exp(0.07 * rng.normal())
        elif name.startswith("link_") and ".com_" in name:
            truth[name] = value + 0.01 * rng.normal()
        elif name.endswith(".stiffness"):
            truth[name] = value * np.exp(0.15 * rng.normal())
    return truth


def empty_poses(model: RobotModel, q: np.ndarray, sigma: float) -> PoseSet:
    """Poses without measured points yet."""
    n = len(q)
    return PoseSet(
        q=q,
        position=np.zeros((n, 3)),
        sigma=np.full((n, 3), sigma),
        torque=None,
        payload=None,
        target=np.full(n, model.point().name),
        station=np.full(n, model.stations.names[0]),
        temperature=None,
        pose=np.arange(n),
    )


@pytest.fixture
def simulate(tx90l: RobotModel) -> Callable[..., Simulated]:
    """simulate(seed, poses, sigma=…, noise=…, truth=…): random poses within the joint limits."""

    def make(
        seed: int,
        poses: int = 60,
        *,
        sigma: float = 3e-5,
        noise: bool = True,
        truth: dict[str, float] | None = None,
    ) -> Simulated:
        from dataclasses import replace

        rng = np.random.default_rng(seed)
        chosen = random_truth(tx90l, rng) if truth is None else truth
        robot = tx90l.with_values(chosen)
        limits = np.array([(joint.lower, joint.upper) for joint in tx90l.joints])
        empty = empty_poses(tx90l, rng.uniform(limits[:, 0], limits[:, 1], (poses, tx90l.n)), sigma)
        points = predict_measurements(robot, empty).position
        if noise:
            points = points + sigma * rng.normal(size=points.shape)
        return Simulated(chosen, robot, replace(empty, position=points))

    return make
