"""The Jacobian of what the instrument reads, against central differences of the whole prediction."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.calibration.measurement import predict_measurements
from flexcal.model.robot import GEOMETRY, RobotModel


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def slope(model: RobotModel, poses, name: str, step: float, flank: np.ndarray) -> np.ndarray:
    ends = [
        predict_measurements(
            model.with_values({name: model.value(name) + s * step}), poses, flank=flank
        ).position
        for s in (1, -1)
    ]
    return (ends[0] - ends[1]) / (2 * step)


@pytest.mark.parametrize(
    ("suffixes", "step", "relative"),
    [
        (
            ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y", "length_z", "backlash"),
            1e-5,
            1e-6,
        ),
        (("tracker.x", "tracker.y", "tracker.z", "tracker.rx", "tracker.ry", "tracker.rz"), 1e-5, 1e-7),
        (("transmission_2_sin", "transmission_3_cos", "gravity_compliance"), 1e-7, 1e-4),
        (("gravity_compliance_1", "gravity_compliance_2"), 1e-8, 1e-5),
        (("com_x", "com_y", "com_z"), 1e-4, 1e-6),
        (("mass",), 1e-3, 1e-6),
        ((".stiffness",), 10.0, 1e-5),
    ],
)
def test_every_column(simulate: Callable, suffixes: tuple, step: float, relative: float) -> None:
    simulated = simulate(3, 25)
    robot = simulated.robot.with_values(
        {"station.tracker.rx": 0.3, "station.tracker.rz": -1.2, "station.tracker.x": 0.8}
    )
    at = predict_measurements(robot, simulated.poses, jacobians=True)
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


def test_geometry_changes_the_torque_that_turns_a_joint(simulate: Callable, tx90l: RobotModel) -> None:
    """Of joints that yield by a degree under gravity, of a robot whose axes are off by ten milliradians."""
    simulated, rng = simulate(3, 15), np.random.default_rng(4)
    names = [f"{owner}.{key}" for owner in (*tx90l.joint_names, "tool") for key in GEOMETRY]
    off = dict(zip(names, rng.normal(0, 1e-2, len(names)).tolist(), strict=True))
    soft = {f"joint_{k}.gravity_compliance": 2e-3 for k in (4, 5, 6)}
    soft |= {f"joint_{k}.gravity_compliance_1": 1e-4 for k in (2, 4)} | {"joint_4.gravity_compliance_2": 4e-4}
    robot = simulated.robot.with_values(off | soft)
    at = predict_measurements(robot, simulated.poses, jacobians=True)
    assert np.abs(at.rest.torque[:, 3:] * 2e-3).max() > 0.02
    names += [f"joint_{k}.{key}" for k in (4, 5) for key in ("transmission_2_sin", "transmission_1_cos")]
    names += ["joint_5.backlash", *soft]
    jacobian = at.jacobian(names)
    for k, name in enumerate(names):
        expected = slope(robot, simulated.poses, name, 1e-7 if name in soft else 1e-5, at.rest.flank)
        np.testing.assert_allclose(jacobian[:, :, k], expected, atol=2e-8, rtol=1e-6, err_msg=name)


def test_columns_of_drives_that_harden(simulate: Callable) -> None:
    """Stiffness acts through the tangent of a drive, and the hardening by the cube of its twist; to the load of the undeflected arm."""
    simulated = simulate(3, 25)
    drives = [f"joint_{k}.drive" for k in (2, 3)]
    robot = simulated.robot.with_values({f"{drive}.hardening": 0.3 for drive in drives})
    at = predict_measurements(robot, simulated.poses, jacobians=True)
    steps = {f"{drive}.hardening": 3e-3 for drive in drives} | {
        f"{drive}.stiffness": 10.0 for drive in drives
    }
    jacobian = at.jacobian(list(steps))
    for k, (name, step) in enumerate(steps.items()):
        expected = slope(robot, simulated.poses, name, step, at.rest.flank)
        size = np.abs(expected).max()
        assert np.abs(jacobian[:, :, k] - expected).max() <= 0.02 * size, name


def test_a_parameter_without_effect_on_points_is_refused(simulate: Callable) -> None:
    simulated = simulate(1, 5)
    with refused("E-CAL-013", "joint_1.delay"):
        predict_measurements(simulated.robot, simulated.poses, jacobians=True).jacobian(["joint_1.delay"])


def with_slide(model: RobotModel, joint: int) -> RobotModel:
    """The robot with one joint sliding along its axis in place of turning about it, and no spring there."""
    joints = tuple(replace(j, kind="prismatic") if i == joint else j for i, j in enumerate(model.joints))
    frames = {i: frame for i, frame in model.springs.bearing_frames.items() if i != joint}
    return replace(model, springs=replace(model.springs, bearing_frames=frames), joints=joints)


@pytest.mark.parametrize("joint", range(6))
def test_every_geometric_column_with_a_slide_anywhere(
    simulate: Callable, tx90l: RobotModel, joint: int
) -> None:
    """A slide before, among or beyond the springs carries the masses beyond it to where their load is another."""
    simulated = simulate(3, 15)
    robot = with_slide(simulated.robot, joint)
    at = predict_measurements(robot, simulated.poses, jacobians=True)
    names = [f"{owner}.{key}" for owner in (*robot.joint_names, "tool") for key in GEOMETRY]
    jacobian = at.jacobian(names)
    for k, name in enumerate(names):
        expected = slope(robot, simulated.poses, name, 1e-5, at.rest.flank)
        np.testing.assert_allclose(jacobian[:, :, k], expected, atol=2e-9, rtol=0, err_msg=name)


def held(model: RobotModel, mass: float) -> RobotModel:
    """The robot with another declared payload mass."""
    assert model.payload is not None
    other = replace(model.payload, mass=mass, nominal_mass=mass, mass_std=0.0)
    return replace(model, payload=other)


def test_the_payload_column_is_in_kilograms_whatever_is_declared(
    simulate: Callable, tx90l: RobotModel
) -> None:
    """Also where robot.yaml declares the place of a payload and no mass: the column is not a share of it."""
    poses = replace(simulate(1, 8).poses, payload=np.array([0.0, 3.0] * 4))
    light, heavy = (
        predict_measurements(held(tx90l, 0.0), poses, jacobians=True),
        predict_measurements(held(tx90l, 6.0), poses),
    )
    np.testing.assert_allclose(light.position, heavy.position, atol=1e-14)
    empty = predict_measurements(held(tx90l, 0.0), replace(poses, payload=None))
    apart = np.linalg.norm(light.position - empty.position, axis=1)
    assert apart[::2].max() < 1e-14 < 1e-5 < apart[1::2].min()
    expected = slope(light.model, poses, "payload.com_x", 1e-4, light.rest.flank)
    np.testing.assert_allclose(
        light.jacobian(["payload.com_x"])[:, :, 0], expected, atol=1e-6 * np.abs(expected).max()
    )


def test_a_payload_found_heavier_makes_all_of_the_column_heavier(
    simulate: Callable, tx90l: RobotModel
) -> None:
    poses = replace(simulate(1, 8).poses, payload=np.full(8, 3.0))
    found = predict_measurements(tx90l.with_values({"payload.mass": 6.6}), poses).position
    np.testing.assert_allclose(
        found, predict_measurements(tx90l, replace(poses, payload=np.full(8, 3.3))).position, atol=1e-14
    )
