"""Distances of the capsules that stand for links, against a search over points of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexcal.design.scene import CollisionChecker, RoughShape
from flexcal.design.scene.rough_shape import _distances
from flexcal.model.kinematics import low_discrepancy_configurations
from flexcal.model.robot import RobotModel

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"


def test_distance_of_segments_is_the_least_of_their_points() -> None:
    rng = np.random.default_rng(3)
    a, b, c, d = rng.normal(size=(4, 200, 3))
    d[:20] = c[:20] + 1.7 * (b - a)[:20]  # parallel
    steps = np.linspace(0.0, 1.0, 201)[:, None, None]
    first, second = a + steps * (b - a), c + steps * (d - c)
    least = np.array(
        [np.linalg.norm(first[:, None, k] - second[None, :, k], axis=-1).min() for k in range(200)]
    )
    found = _distances(a, b, c, d)
    assert np.all(found <= least + 1e-12)
    assert found == pytest.approx(least, abs=0.03)


def test_close_links_seldom_are_those_that_do_not_collide() -> None:
    """Against the collision shapes of the same robot: capsules are thinner, so what they tell is mostly true."""
    model = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    q = low_discrepancy_configurations(model, 600)
    near = np.array([bool(pairs) for pairs in RoughShape.of(model).close(q)])
    collides = CollisionChecker(model, floor=None).collides(q)
    assert near.sum() > 10
    assert collides[near].mean() > 0.8
