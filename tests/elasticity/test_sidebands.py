"""Friction pulses and open gaps by harmonic balance, against the exact periodic solution in the time domain (Floquet)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from flexcal.elasticity import ReferenceMotion
from flexcal.elasticity.friction_pulses import FrictionPulses
from flexcal.elasticity.gap import gap_shift
from flexcal.model.equilibrium import elastic_axes
from flexcal.model.linearisation import Linearisation, linearise

STEPS = 1200
FREQUENCIES = np.array([7.25, 19.25, 33.75])
Change = Callable[[float], tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def motion(tx90l) -> ReferenceMotion:
    """1.5° at 2.125 Hz under a multisine that makes pulses of about 10 ms."""
    kp, kd = np.array(tx90l.controller.kp[:3]), np.array(tx90l.controller.kd[:3])
    return ReferenceMotion(np.deg2rad(1.5), 2.125, kp, kd, np.full((3, 3), 60.0))


def floquet(system: Linearisation, motion: ReferenceMotion, frequency: float, change: Change) -> np.ndarray:
    """G (E, E) of M ẍ + (D + ΔD(t)) ẋ + (K + ΔK(t)) x = B u, with `change` giving ΔD, ΔK at a phase of the motion.

    The answer to exp(jωt) is exp(jωt) times a periodic function. Steps are exact for matrices constant over them.
    """
    count, size = system.inputs, len(system.mass)
    motors = range(count)
    damping, stiffness = system.damping.copy(), system.stiffness.copy()
    damping[motors, motors] += motion.kd
    stiffness[motors, motors] += motion.kp
    inverse = np.linalg.inv(system.mass)
    step, s = 1 / (motion.frequency_hz * STEPS), 2j * np.pi * frequency
    rows = np.zeros((STEPS, 2 * size + count, 2 * size + count), dtype=complex)
    for n in range(STEPS):
        more_damping, more_stiffness = change(2 * np.pi * (n + 0.5) / STEPS)
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

    def change(phase: float) -> tuple[np.ndarray, np.ndarray]:
        late = np.mod(phase, np.pi) - 0.5 * np.pi
        sigma = width * 2 * np.pi * motion.frequency_hz
        shape = sum(np.exp(-0.5 * ((late + k * np.pi) / sigma) ** 2) for k in (-1, 0, 1))
        pulse = np.pi * shape / (np.sqrt(2 * np.pi) * sigma)
        more = np.zeros_like(system.mass)
        more[range(3), range(3)] = friction * (pulse - 1.0)
        return more, np.zeros_like(more)

    check(system, motion, change, shift)


def test_open_gaps(tx90l, poses, motion):
    system = linearise(tx90l, poses["default"][5])
    phases = 2 * np.pi * np.arange(64) / 64
    share = np.zeros((64, 3))
    share[:, 2] = 0.25 * np.exp(-0.5 * ((phases - 4.0) / 0.7) ** 2)
    share[:, 1] = 0.1 * np.exp(-0.5 * ((phases - 2.0) / 0.5) ** 2)
    shift = gap_shift(tx90l, system, FREQUENCIES, motion, share)
    twists = [k for k, (_, component) in enumerate(elastic_axes(tx90l)) if component == 2]

    def change(phase: float) -> tuple[np.ndarray, np.ndarray]:
        damping, stiffness = np.zeros_like(system.mass), np.zeros_like(system.mass)
        for axis in (1, 2):
            open_more = np.interp(phase, phases, share[:, axis], period=2 * np.pi) - share[:, axis].mean()
            pull = np.zeros(len(system.mass))
            pull[3 + twists[axis]], pull[axis] = 1.0, -1.0
            joint = tx90l.elastic[axis]
            stiffness -= open_more * joint.stiffness[2] * np.outer(pull, pull)
            damping -= open_more * joint.damping[2] * np.outer(pull, pull)
        return damping, stiffness

    check(system, motion, change, shift)


def check(system: Linearisation, motion: ReferenceMotion, change: Change, shift: np.ndarray) -> None:
    """The shift within 2 % of its size of the exact one, which is seen to be none without the change."""
    nothing = np.zeros_like(system.mass)
    for k, frequency in enumerate(FREQUENCIES):
        still = floquet(system, motion, frequency, lambda _: (nothing, nothing))
        exact = floquet(system, motion, frequency, change) - still
        assert np.abs(exact).max() > 1e-3 * np.abs(still).max()
        np.testing.assert_allclose(shift[k], exact, atol=0.02 * np.abs(exact).max())
