"""The Jacobian of what the instrument reads, against central differences of the whole prediction."""

from collections.abc import Callable

import numpy as np
import pytest

from flexcal.calibration import predict
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel


def slope(model: RobotModel, poses, name: str, step: float, flank: np.ndarray) -> np.ndarray:
    ends = [
        predict(model.with_values({name: model.value(name) + s * step}), poses, flank=flank).position
        for s in (1, -1)
    ]
    return (ends[0] - ends[1]) / (2 * step)


@pytest.mark.parametrize(
    ("suffixes", "step", "relative"),
    [
        (
            ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y", "length_z", "backlash"),
            1e-5,
            5e-3,
        ),
        (("tracker.x", "tracker.y", "tracker.z", "tracker.rx", "tracker.ry", "tracker.rz"), 1e-5, 1e-7),
        (("transmission_2_sin", "transmission_3_cos", "gravity_compliance"), 1e-7, 1e-4),
        (("com_x", "com_y", "com_z"), 1e-4, 1e-6),
        (("mass",), 1e-3, 1e-6),
        (("stiffness",), 10.0, 1e-5),
    ],
)
def test_every_column(simulate: Callable, suffixes: tuple, step: float, relative: float) -> None:
    simulated = simulate(3, 25)
    robot = simulated.robot.with_values(
        {"station.tracker.rx": 0.3, "station.tracker.rz": -1.2, "station.tracker.x": 0.8}
    )
    at = predict(robot, simulated.poses, jacobians=True)
    elastic = ("joint_1", "joint_2", "joint_3")
    names = [
        n for n in robot.values if n.endswith(suffixes) and not n.startswith("point.") and "torque" not in n
    ]
    names = [n for n in names if not n.endswith("backlash") or n.startswith(("joint_2", "joint_3"))]
    names = [n for n in names if not n.endswith("gravity_compliance") or not n.startswith(elastic)]
    jacobian = at.jacobian(names)
    assert len(names) >= 3 or suffixes == ("mass",)
    for k, name in enumerate(names):
        expected = slope(robot, simulated.poses, name, step, at.rest.flank)
        size = np.abs(expected).max()
        assert np.abs(jacobian[:, :, k] - expected).max() <= relative * size + 1e-9, name


def test_a_parameter_without_effect_on_points_is_refused(simulate: Callable) -> None:
    simulated = simulate(1, 5)
    with pytest.raises(FlexcalError, match=r"does not depend on 'joint_1.delay'"):
        predict(simulated.robot, simulated.poses, jacobians=True).jacobian(["joint_1.delay"])
