"""Friction pulses, and the moving arm with open gaps, by harmonic balance: against the exact periodic solution in time (Floquet)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import expm

from flexcal.elasticity.time_periodic import FrictionPulses, ReferenceMotion, reference_shift
from flexcal.elasticity.time_periodic.reference_motion import ArmState
from flexcal.model.robot import ArmSensor
from flexcal.model.robot.measuring_config import ArmSensorConfig
from flexcal.model.statics import elastic_axes
from flexcal.model.vibration import ElasticArm, Linearisation, linearise

STEPS = 600
FREQUENCIES = np.array([7.25, 19.25, 33.75])
Change = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def motion(tx90l) -> ReferenceMotion:
    """1.5° at 2.125 Hz under a multisine that makes pulses of about 10 ms."""
    kp, kd = np.array(tx90l.controller.kp[:3]), np.array(tx90l.controller.kd[:3])
    return ReferenceMotion(np.deg2rad(1.5), 2.125, kp, kd, np.full((3, 3), 60.0))


def floquet(system: Linearisation, motion: ReferenceMotion, frequency: float, change: Change) -> np.ndarray:
    """G (E, E) of (M + ΔM(t)) ẍ + (D + ΔD(t)) ẋ + (K + ΔK(t)) x = B u, with `change` giving ΔM, ΔD, ΔK at a phase of the motion.

    The answer to exp(jωt) is exp(jωt) times a periodic function. Steps are exact for matrices constant over them.
    """
    count, size = system.inputs, len(system.mass)
    motors = range(count)
    damping, stiffness = system.damping.copy(), system.stiffness.copy()
    damping[motors, motors] += motion.kd
    stiffness[motors, motors] += motion.kp
    step, s = 1 / (motion.frequency_hz * STEPS), 2j * np.pi * frequency
    rows = np.zeros((STEPS, 2 * size + count, 2 * size + count), dtype=complex)
    for n in range(STEPS):
        more_mass, more_damping, more_stiffness = change(2 * np.pi * (n + 0.5) / STEPS)
        inverse = np.linalg.inv(system.mass + more_mass)
        rows[n, :size, size : 2 * size] = np.eye(size)
        rows[n, size : 2 * size, :size] = -inverse @ (stiffness + more_stiffness)
        rows[n, size : 2 * size, size : 2 * size] = -inverse @ (damping + more_damping)
        rows[n, size : 2 * size, 2 * size :] = inverse[:, :count]
        rows[n, 2 * size :, 2 * size :] = s * np.eye(count)
    steps = expm(step * rows)
    whole = np.eye(2 * size + count)
    for one in steps:
        whole = one @ whole
    turn = np.exp(s * STEPS * step)
    state = np.vstack(
        [
            np.linalg.solve(
                turn * np.eye(2 * size) - whole[: 2 * size, : 2 * size], whole[: 2 * size, 2 * size :]
            ),
            np.eye(count),
        ]
    )
    mean = np.zeros((count, count), dtype=complex)
    for n, one in enumerate(steps):
        mean += state[:count] * np.exp(-s * n * step) / STEPS
        state = one @ state
    torque = np.eye(count) - (motion.kp + s * motion.kd)[:, None] * mean
    return s**2 * mean @ np.linalg.inv(torque)


def test_friction_pulses(tx90l, poses, motion):
    q, friction = poses["default"][2], np.array([40.0, 40.0, 20.0])
    names = [f"joint_{axis}.viscous" for axis in (1, 2, 3)]
    dragging = tx90l.with_values(
        {name: tx90l.value(name) + more for name, more in zip(names, friction, strict=True)}
    )
    system = linearise(dragging, q)
    pulses = FrictionPulses.of(system, FREQUENCIES, motion, friction)
    assert (pulses.width > 5e-3).all() and (pulses.width < 0.1).all()
    width = np.full(3, 0.012)
    shift = replace(pulses, width=width).shift

    def change(phase: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        late = np.mod(phase, np.pi) - 0.5 * np.pi
        sigma = width * 2 * np.pi * motion.frequency_hz
        shape = sum(np.exp(-0.5 * ((late + k * np.pi) / sigma) ** 2) for k in (-1, 0, 1))
        pulse = np.pi * shape / (np.sqrt(2 * np.pi) * sigma)
        more = np.zeros_like(system.mass)
        more[range(3), range(3)] = friction * (pulse - 1.0)
        return np.zeros_like(more), more, np.zeros_like(more)

    check(system, motion, change, shift)


def test_shift_by_form_is_the_derivative(tx90l, poses, motion):
    config = ArmSensorConfig("link_3", (0.1, 0.0, 0.2), (0.6, 0.0, 0.8))
    place, direction = np.array(config.xyz), np.array(config.direction)
    sensor = ArmSensor("tip", 2, place, direction, moves=True, order=2, config=config)
    system = linearise(tx90l, poses["default"][2], sensors=[sensor])
    pulses = FrictionPulses.of(system, FREQUENCIES, motion, np.array([40.0, 30.0, 10.0]))
    derivative, step = pulses.shift_by_form(), 1e-4
    for axis, more in enumerate(np.exp(step * np.eye(3))):
        for column, name in ((axis, "strength"), (3 + axis, "width")):
            value = getattr(pulses, name)
            above, below = (replace(pulses, **{name: value * factor}).shift for factor in (more, 1 / more))
            measured = (above - below) / (2 * step)
            assert measured.shape == (3, 4, 3)
            for rows in (slice(3), slice(3, 4)):
                size = np.abs(measured[:, rows]).max()
                assert size > 0
                np.testing.assert_allclose(
                    derivative[:, rows, :, column], measured[:, rows], atol=1e-6 * size
                )


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_moving_arm_and_open_gaps(tx90l, poses, motion, bearings):
    """Together: what the motion couples at the sidebands, the gaps bring back to the line, also between axes at right angles."""
    q, tx90l = poses["default"][5], tx90l.with_bearings(bearings)
    system, arm = linearise(tx90l, q), ElasticArm(tx90l)
    phases = 2 * np.pi * np.arange(64) / 64
    share = np.zeros((64, 3))
    share[:, 2] = 0.25 * np.exp(-0.5 * ((phases - 4.0) / 0.7) ** 2)
    share[:, 1] = 0.1 * np.exp(-0.5 * ((phases - 2.0) / 0.5) ** 2)
    shift = reference_shift(tx90l, q, None, FREQUENCIES, motion, np.stack([share, share]))
    twists = [k for k, (_, component) in enumerate(elastic_axes(tx90l)) if component == 2]
    rest = arm_matrices(arm, next(replace(motion, amplitude=0.0).states(tx90l, arm, q, 1)))
    states = list(motion.states(tx90l, arm, q, 2 * STEPS))[1::2]
    moved = np.array([arm_matrices(arm, state) for state in states]) - rest

    def change(phase: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        more = np.zeros((3, *system.mass.shape))
        more[:, 3:, 3:] = moved[int(STEPS * phase / (2 * np.pi))]
        for axis in (1, 2):
            open_more = np.interp(phase, phases, share[:, axis], period=2 * np.pi) - share[:, axis].mean()
            pull = np.zeros(len(system.mass))
            pull[3 + twists[axis]], pull[axis] = 1.0, -1.0
            joint = tx90l.elastic[axis]
            more[1] -= open_more * joint.damping[2] * np.outer(pull, pull)
            more[2] -= open_more * joint.stiffness[2] * np.outer(pull, pull)
        return more[0], more[1], more[2]

    check(system, motion, change, shift)


def arm_matrices(arm: ElasticArm, state: ArmState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, ∂τ/∂q̇ and ∂τ/∂q (d, d) by central differences of the inverse dynamics."""
    index = np.ix_(arm.elastic, arm.elastic)

    def torque(dq: np.ndarray, dv: np.ndarray, da: np.ndarray) -> np.ndarray:
        at = pin.integrate(arm.model, state.configuration, dq)
        return pin.rnea(arm.model, arm.data, at, state.velocity + dv, state.acceleration + da)

    none, step = np.zeros(arm.model.nv), 1e-4
    parts = []
    for number in (2, 1, 0):
        columns = []
        for unit in step * np.eye(arm.model.nv):
            ahead, back = ([none] * number + [sign * unit] + [none] * (2 - number) for sign in (1, -1))
            columns.append((torque(*ahead) - torque(*back)) / (2 * step))
        parts.append(np.array(columns).T[index])
    return parts[0], parts[1], parts[2]


def check(system: Linearisation, motion: ReferenceMotion, change: Change, shift: np.ndarray) -> None:
    """Every element's shift within 2 % of its largest of the exact one, which is seen to be none without the change."""
    nothing = np.zeros_like(system.mass)
    still = [floquet(system, motion, f, lambda _: (nothing, nothing, nothing)) for f in FREQUENCIES]
    exact = np.array([floquet(system, motion, f, change) for f in FREQUENCIES]) - still
    assert np.abs(exact).max() > 1e-3 * np.abs(still).max()
    for k in np.ndindex(*exact.shape[1:]):
        np.testing.assert_allclose(shift[:, *k], exact[:, *k], atol=0.02 * np.abs(exact[:, *k]).max())
