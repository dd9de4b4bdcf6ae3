"""M, D, K and G: published modes of the bare TX90L, and every derivative against central differences."""

import numpy as np
import pytest
from refusals import refused
from scipy.linalg import eigh

from flexcal.model.parts import Bearings
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import ElasticArm, linearise, transfer_matrix
from flexcal.units import DEGREE

LINES = np.arange(3.25, 80, 2.0)


@pytest.mark.parametrize(
    ("bearings", "pose", "modes_hz"),
    [
        ("after", (0, 90, 0, 0, 0, 0), (11.1, 13.3, 39.7, 63.7)),
        ("after", (0, 45, 60, 0, 45, 0), (12.9, 14.7, 32.6, 44.0)),
        ("after", (0, 0, 90, 0, 0, 0), (16.3, 17.9, 28.0, 34.4)),
        ("before", (0, 90, 0, 0, 0, 0), (11.0, 13.3, 39.9, 63.7)),
        ("before", (0, 45, 60, 0, 45, 0), (12.7, 14.7, 32.7, 43.3)),
        ("before", (0, 0, 90, 0, 0, 0), (16.3, 17.7, 28.0, 33.9)),
    ],
)
def test_locked_motor_modes_of_the_bare_arm(
    tx90l: RobotModel, bearings: Bearings, pose: tuple, modes_hz: tuple
) -> None:
    system = linearise(tx90l.with_bearings(bearings), np.array(pose) * DEGREE, 0.0)
    squares = eigh(system.stiffness[3:, 3:], system.mass[3:, 3:], eigvals_only=True)
    np.testing.assert_allclose(np.sqrt(squares[:4]) / (2 * np.pi), modes_hz, atol=0.06)


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_every_derivative_of_the_transfer_matrix(tx90l: RobotModel, bearings: Bearings) -> None:
    tx90l = tx90l.with_bearings(bearings)
    q = np.array([0.3, 0.7, -0.4, 0.5, 0.6, 0.2])
    endings = ("stiffness", "damping", "rotor_inertia", "viscous", "mass", "com_x", "com_y", "com_z")
    names = [
        n
        for n in tx90l.values
        if n.endswith(tuple(f".{e}" for e in endings)) and not (n.startswith("joint_") and n[6] in "456")
    ]
    moved = transfer_matrix(linearise(tx90l, q, derivatives=names), LINES)
    exact = dict(zip(moved.names, np.moveaxis(moved.derivatives, -1, 0), strict=True))

    def response(name: str, value: float) -> np.ndarray:
        return transfer_matrix(linearise(tx90l.with_values({name: value}), q), LINES).response

    def slope(name: str, step: float) -> np.ndarray:
        value = tx90l.value(name)
        return (response(name, value + step) - response(name, value - step)) / (2 * step)

    for name in names:
        step = 1e-4 if ".com" in name else 1e-4 * tx90l.value(name)
        richardson = (4 * slope(name, step / 2) - slope(name, step)) / 3
        assert np.abs(richardson - exact[name]).max() < 1e-6 * np.abs(exact[name]).max(), name


def test_derivatives_by_the_springs_of_a_braked_wrist(tx90l: RobotModel) -> None:
    q = np.array([0.3, 0.7, -0.4, 0.5, 0.6, 0.2])
    wrist = tx90l.with_drive_springs(dict.fromkeys((3, 4, 5), (5e4, 50.0)))
    robot = wrist.with_values({"joint_4.held_inertia": 0.2})
    names = [
        f"joint_{i}.{key}" for i in (4, 5, 6) for key in ("drive.stiffness", "drive.damping", "held_inertia")
    ]
    names += ["link_5.mass", "payload.mass", "joint_1.bearing_x.stiffness"]
    moved = transfer_matrix(linearise(robot, q, derivatives=names), LINES)
    assert moved.response.shape == (len(LINES), 3, 3)
    for name, exact in zip(moved.names, np.moveaxis(moved.derivatives, -1, 0), strict=True):
        value, step = robot.value(name), 1e-3 * max(robot.value(name), 0.1)
        ends = [
            transfer_matrix(linearise(robot.with_values({name: value + s}), q), LINES).response
            for s in (step, -step, step / 2, -step / 2)
        ]
        slope = (8 * (ends[2] - ends[3]) - (ends[0] - ends[1])) / (6 * step)
        assert np.abs(slope - exact).max() < 1e-6 * np.abs(exact).max(), name


def test_the_payloads_inertia_grows_with_its_mass(tx90l: RobotModel) -> None:
    """In the value and in the derivative alike, as that of a link does."""
    q, held = np.array([0.3, 0.7, -0.4, 0.5, 0.6, 0.2]), tx90l.payload
    assert held is not None
    bulky = tx90l.with_values({"payload.Ixx": 0.3, "payload.Iyy": 0.2, "payload.Izz": 0.1})
    heavier = bulky.with_values({"payload.mass": 9.0}).payload
    assert heavier is not None
    np.testing.assert_allclose(heavier.inertia, 1.5 * np.diag([0.3, 0.2, 0.1]))
    np.testing.assert_allclose(
        heavier.carried(3.0).inertia, held.rotation @ np.diag([0.15, 0.1, 0.05]) @ held.rotation.T
    )
    exact = linearise(bulky, q, derivatives=["payload.mass"]).derivatives["payload.mass"][0]
    ends = [linearise(bulky.with_values({"payload.mass": 6.0 + s}), q).mass for s in (1e-3, -1e-3)]
    np.testing.assert_allclose(exact, (ends[0] - ends[1]) / 2e-3, atol=1e-6 * np.abs(exact).max())
    unloaded = linearise(bulky, q, 0.0, derivatives=["payload.mass"]).derivatives["payload.mass"][0]
    ends = [linearise(bulky, q, mass).mass for mass in (1e-3, 0.0)]
    np.testing.assert_allclose(unloaded, (ends[0] - ends[1]) / 1e-3, atol=1e-4 * np.abs(unloaded).max())


def test_free_rotors_show_poles_and_zeros(tx90l: RobotModel) -> None:
    """The literal Eq. (9) has no antiresonance; what is implemented has one at the locked-motor mode of 11.1 Hz on axis 1."""
    lines = np.arange(8.0, 15.0, 0.05)
    response = transfer_matrix(linearise(tx90l, np.array([0, 90, 0, 0, 0, 0]) * DEGREE, 0.0), lines).response
    assert abs(lines[np.abs(response[:, 0, 0]).argmin()] - 11.1) < 0.2


def test_a_robot_without_springs_is_refused(ur5: RobotModel) -> None:
    with refused("E-MODEL-013"):
        linearise(ur5, np.zeros(6))


@pytest.mark.parametrize("bearings", ["after", "before"])
@pytest.mark.parametrize(
    "values",
    [
        {"link_3.mass": 31.0, "link_2.com_y": 0.04, "payload.mass": 4.0, "joint_2.drive.stiffness": 5e5},
        {"joint_2.misalignment_1": 0.02, "joint_3.length_x": 0.01},
    ],
)
def test_an_arm_that_is_made_from_another_is_the_same(tx90l, bearings, values):
    q, like = np.array([0.3, -0.5, 1.2, 0.4, 0.9, -0.5]), ElasticArm(tx90l, 7.0)
    robot = tx90l.with_values(values).with_bearings(bearings)
    own, made = linearise(robot, q, 3.0), linearise(robot, q, 3.0, like=like)
    for name in ("mass", "damping", "stiffness"):
        assert np.array_equal(getattr(own, name), getattr(made, name))
    before = linearise(tx90l, q, 7.0)
    assert not np.array_equal(own.mass, before.mass)
    assert np.array_equal(before.mass, linearise(tx90l, q, 7.0, like=like).mass)
