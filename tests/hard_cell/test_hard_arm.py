"""The hard cell's arm against the numbers of the robot's notes, closed forms, and its own equations of motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexcal.hard_cell import ArmDescription, HardRobot, read_description
from flexcal.hard_cell import closed_loop as loop
from flexcal.hard_cell.closed_loop import Command, moving_arm, run_loop
from flexcal.hard_cell.description import Link
from flexcal.hard_cell.equilibrium import stand
from flexcal.hard_cell.multibody import Multibody, build
from flexcal.hard_cell.true_parameters import ideal_robot

POSES = {"A": [0, 90, 0, 0, 0, 0], "B": [0, 45, 60, 0, 45, 0], "C": [0, 0, 90, 0, 0, 0]}
NOTES = {  # Hz, all motors locked, bearing axes fixed in the parent: the table of the TX90L's notes
    ("A", 0.0): (11.0, 13.3, 39.9, 63.7),
    ("B", 0.0): (12.7, 14.7, 32.7, 43.3),
    ("C", 0.0): (16.3, 17.7, 28.0, 33.9),
    ("A", 6.0): (9.1, 10.1, 35.2, 51.0),
    ("B", 6.0): (10.7, 11.5, 27.3, 35.1),
    ("C", 6.0): (12.4, 13.5, 24.1, 29.9),
}
TURNING = {  # Hz, the axes turning with the child, without payload: the same notes
    "A": (11.1, 13.3, 39.7, 63.7),
    "B": (12.9, 14.7, 32.6, 44.0),
    "C": (16.3, 17.9, 28.0, 34.4),
}
DEFLECTION = {"A": 2.47, "B": 1.73, "C": 1.00}  # mm, of the tool


@pytest.fixture(scope="module")
def tx90l(examples: Path) -> ArmDescription:
    return read_description(examples / "tx90l" / "robot.yaml")


def at_rest(robot: HardRobot, q: np.ndarray, payload: float, free: tuple[int, ...] = ()):
    """The arm with the other motors braked, and its mass and stiffness (d, d) at rest, gravity's share by central differences."""
    whole = build(robot, payload=payload)
    resting = stand(robot, whole, q)
    arm = build(robot, payload=payload, free=free, held_at=q)
    angles = np.array([resting.angles[whole.hinge(*hinge)] for hinge in arm.hinges])
    step = np.eye(len(angles)) * 1e-5
    stiffness = np.array([(arm.gravity(angles + e) - arm.gravity(angles - e)) / 2e-5 for e in step]).T
    springs = np.where(np.isfinite(robot.arm.springs), robot.arm.springs, 0.0)
    return arm, mass_matrix(arm, angles), stiffness + np.diag(arm.springs(springs))


def mass_matrix(arm: Multibody, angles: np.ndarray) -> np.ndarray:
    arm.gravity(angles)
    mass = np.empty((len(angles), len(angles)))
    for row, unit in zip(mass, np.eye(len(angles)), strict=True):
        mujoco.mj_mulM(arm.mjmodel, arm.data, row, unit)
    return mass


def modes(robot: HardRobot, pose: str, payload: float) -> np.ndarray:
    _, mass, stiffness = at_rest(robot, np.deg2rad(POSES[pose]), payload)
    return np.sqrt(eigh((stiffness + stiffness.T) / 2, mass, eigvals_only=True))[:4] / (2 * np.pi)


@pytest.mark.parametrize(("pose", "payload"), NOTES)
def test_modes_with_parent_fixed_bearings_are_those_of_the_notes(tx90l, pose: str, payload: float) -> None:
    robot = ideal_robot(
        replace(tx90l, held_com=np.array([0.1, 0.0, 0.0]))
    )  # the notes hold it on the flange's axis
    np.testing.assert_allclose(modes(robot, pose, payload), NOTES[pose, payload], atol=0.1)


@pytest.mark.parametrize("pose", TURNING)
def test_modes_with_turning_bearings_are_those_of_the_notes(tx90l, pose: str) -> None:
    robot = ideal_robot(tx90l, bearings_before=False)
    np.testing.assert_allclose(modes(robot, pose, 0.0), TURNING[pose], atol=0.07)


@pytest.mark.parametrize("pose", DEFLECTION)
def test_the_tool_sags_as_in_the_notes(tx90l, pose: str) -> None:
    flange = next(k for k, link in enumerate(tx90l.links) if link.name == "flange")
    soft = ideal_robot(replace(tx90l, point=("flange", flange, np.zeros(3))))
    stiff = replace(soft, arm=replace(soft.arm, springs=1e6 * soft.arm.springs))
    there, here = (stand(r, build(r, payload=0.0), np.deg2rad(POSES[pose])).point for r in (stiff, soft))
    assert 1e3 * np.linalg.norm(there - here) == pytest.approx(DEFLECTION[pose], abs=0.01)


def pendulum(*, stiffness: float = 2e4, damping: float = 0.0, gravity: float = 9.81) -> ArmDescription:
    """10 kg at 0.8 m from one axis of 4 kg m² of rotor, horizontal at zero; a positive angle lifts it."""
    link = Link(
        "arm",
        "joint",
        -1,
        np.zeros(3),
        np.eye(3),
        np.array([0.0, -1.0, 0.0]),
        10.0,
        np.array([0.8, 0, 0]),
        1e-3 * np.eye(3),
    )
    return ArmDescription(
        name="pendulum",
        links=(link,),
        springs=np.array([[np.inf, np.inf, stiffness]]),
        dampers=np.array([[0.0, 0.0, damping]]),
        bearing=np.eye(3)[None],
        rotor_inertia=np.array([4.0]),
        viscous=np.zeros(1),
        coulomb=np.zeros(1),
        ratio=np.array([100.0]),
        backlash_joints=(0,),
        gravity=np.array([0.0, 0.0, -gravity]),
        point=("tip", 0, np.array([0.8, 0.0, 0.0])),
        station=("tracker", np.zeros(3)),
    )


def test_a_gear_at_rest_against_its_closed_form() -> None:
    """Gap, hardening, hysteresis and transmission error of one drive under 10 kg at 0.8 m."""
    robot = replace(
        ideal_robot(pendulum()),
        backlash=np.array([4e-5]),
        hardening=np.array([[0, 0, 2e5]]),
        hysteresis=np.array([1e-5]),
        error_amplitude=np.array([[5e-5, 2e-5, 1e-5, 5e-6]]),
        error_phase=np.array([[0.3, 1.0, 2.0, 4.0]]),
    )
    q = 0.4
    orders = np.array([1, 2, 100, 200])
    error = (robot.error_amplitude[0] * np.sin(orders * q + robot.error_phase[0])).sum()

    def unbalance(stretch: float) -> float:
        weight = 10 * 9.81 * 0.8 * np.cos(q + stretch - 4e-5 + error)
        return 2e4 * (stretch + 2e5 * stretch**3) + weight + 2e4 * 1e-5 * 0.5

    stretch = brentq(unbalance, -0.1, 0.1, xtol=1e-15)
    found = stand(robot, build(robot), np.array([q]), slip=np.array([0.5]))
    assert found.angles[1] == pytest.approx(stretch - 4e-5 + error, rel=1e-9)
    assert found.torque[0] == pytest.approx(10 * 9.81 * 0.8 * np.cos(q + found.angles[1]), rel=1e-9)
    np.testing.assert_allclose(
        found.point, 0.8 * np.array([np.cos(q + found.angles[1]), 0, np.sin(q + found.angles[1])])
    )


def swing(rate_hz: float, seconds: float, robot: HardRobot, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """Motor angle of a robot that is let go with its gear wound up by 10 mrad, without torque."""
    monkeypatch.setattr(loop, "ENCODER_COUNTS", 2**44)
    moving = moving_arm(robot, np.zeros(1), [0], 0.0, rate_hz)
    nothing = np.zeros((round(seconds * rate_hz), 1))
    moving = replace(moving, start=np.array([0.0, 0.01]))
    angle, _ = run_loop(moving, Command(nothing, nothing, nothing), np.zeros(1), np.zeros(1), np.zeros(1))
    return angle[:, 0]


def test_two_inertias_on_a_spring_swing_for_ever_at_their_frequency(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without gravity and losses: the centre keeps its speed, the swing its frequency and size, for a hundred periods."""
    rotor, load, k = 4.0, 10 * 0.8**2 + 1e-3, 2e4
    omega, share = np.sqrt(k * (1 / rotor + 1 / load)), load / (rotor + load)
    angle = swing(4000.0, 8.0, ideal_robot(pendulum(gravity=0.0)), monkeypatch)
    time = np.arange(len(angle)) / 4000
    assert angle.min() == pytest.approx(0.0, abs=2e-6)
    for second in (slice(4000), slice(-4000, None)):
        assert np.ptp(angle[second]) == pytest.approx(0.02 * share, rel=2e-3)
        assert angle[second].mean() == pytest.approx(0.01 * share, rel=5e-2)
    up = np.flatnonzero((angle[1:] > 0.01 * share) & (angle[:-1] <= 0.01 * share))
    assert 2 * np.pi * (len(up) - 1) / (time[up[-1]] - time[up[0]]) == pytest.approx(omega, rel=5e-4)


def test_halving_the_step_quarters_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hardening spring, damper, bristle friction and gear error: second order in the step."""
    robot = replace(
        ideal_robot(pendulum(damping=20.0)),
        hardening=np.array([[0, 0, 2e5]]),
        error_amplitude=np.array([[5e-4, 2e-4, 0, 0]]),
    )
    ends = [
        swing(rate, 0.25, robot, monkeypatch)[:: round(rate / 1000)][:249]
        for rate in (1000, 2000, 4000, 16000)
    ]
    coarse, fine = (np.abs(end - ends[-1]).max() for end in ends[1:3])
    assert fine < 0.4 * coarse < 1e-3


def test_the_arm_moves_as_its_mass_damping_and_stiffness_say(tx90l, monkeypatch: pytest.MonkeyPatch) -> None:
    """Motor angles under a multisine against those of K + jω D − ω² M about the rest position, 6 to 80 Hz, brakes on an elastic wrist."""
    monkeypatch.setattr(loop, "ENCODER_COUNTS", 2**44)
    wrist = tx90l.springs.copy()
    wrist[3:, 2] = 1e5, 8e4, 1.5e5
    damped = np.where(np.isfinite(tx90l.springs), tx90l.dampers, 0)
    damped[3:, 2] = 30.0
    robot = ideal_robot(replace(tx90l, springs=wrist, dampers=damped, coulomb=np.zeros(6)))
    pose, free, rate = np.deg2rad([0, 45, 60, 20, 45, 0]), (0, 1, 2), 4000
    lines = np.arange(6, 80, 7)
    rng = np.random.default_rng(5)
    time = np.arange(8 * rate) / rate
    phases = rng.uniform(0, 2 * np.pi, (3, len(lines)))
    push = 3 * np.cos(2 * np.pi * lines * time[:, None, None] + phases).sum(axis=2)
    hold = stand(robot, build(robot, payload=6.0), pose).torque[:3]
    moving = moving_arm(robot, pose, free, 6.0, rate)
    assert {part for j, part in moving.arm.hinges if j > 2} == {"twist"}
    command = Command(hold + push, np.tile(pose[:3], (len(time), 1)), np.zeros((len(time), 3)))
    angle, torque = run_loop(
        moving, command, np.zeros(3), np.array([3000.0, 3000, 800]), np.array([400.0, 400, 100])
    )
    arm, mass, stiffness = at_rest(robot, pose, 6.0, free)
    damping = np.diag(arm.springs(damped))
    motors = [arm.hinge(j, "motor") for j in free]
    damping[motors, motors] += tx90l.viscous[:3]
    others = [i for i in range(len(mass)) if i not in motors]
    moved, pushed = (2 / rate * np.fft.rfft(x[-rate:], axis=0)[lines] for x in (angle, torque))
    for f, q, t in zip(lines, moved, pushed, strict=True):
        s = 2j * np.pi * f
        z = mass * s**2 + damping * s + stiffness
        reduced = z[np.ix_(motors, motors)] - z[np.ix_(motors, others)] @ np.linalg.solve(
            z[np.ix_(others, others)], z[np.ix_(others, motors)]
        )
        held = np.sinc(f / rate) * np.exp(-1j * np.pi * f / rate)
        np.testing.assert_allclose(np.linalg.solve(reduced, held * t), q, atol=1e-3 * np.abs(q).max())
