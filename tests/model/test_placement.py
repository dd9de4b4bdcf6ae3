"""The chain that exporters, design and the elastic arm share, against the kernels, which hold their own."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.model.kinematics import link_placement, point_kinematics, point_placement
from flexcal.model.robot import GEOMETRY, RobotModel


@pytest.mark.parametrize("slides", [(), (0,), (2, 4), (5,)])
def test_links_and_point_lie_where_the_kernels_put_them(tx90l: RobotModel, slides: tuple[int, ...]) -> None:
    rng = np.random.default_rng(7)
    joints = tuple(replace(j, kind="prismatic") if i in slides else j for i, j in enumerate(tx90l.joints))
    frames = {i: frame for i, frame in tx90l.springs.bearing_frames.items() if i not in slides}
    model = replace(
        tx90l,
        springs=replace(tx90l.springs, bearing_frames=frames),
        joints=joints,
    )
    names = [f"{owner}.{key}" for owner in (*model.joint_names, "tool") for key in GEOMETRY]
    model = model.with_values({name: 0.05 * rng.normal() for name in [*names, "point.smr.x"]})
    q = rng.uniform(-2, 2, (10, 6))
    expected = point_kinematics(model, q, jacobians=False)
    for k, row in enumerate(q):
        total, at = np.eye(3), np.zeros(3)
        for i in range(6):
            position, rotation = link_placement(model, i, row[i])
            total, at = total @ rotation, at + total @ position
        carrier, position, rotation = point_placement(model, "smr")
        assert carrier == 5
        np.testing.assert_allclose(at + total @ position, expected.position[k], atol=1e-12)
        np.testing.assert_allclose(total @ rotation, expected.orientation[k], atol=1e-12)
