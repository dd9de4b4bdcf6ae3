"""Predicted noise of a frequency response: sensors, and friction under excitation and reference motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.frequency.periodic import multisine_spectra, reference_trajectory, synthesise
from flexcal.model.robot import SHARED_DISTORTION, RobotModel
from flexcal.model.vibration import Linearisation, closed_loop_motion

DRAWS = 3
"""Number of realisations of the multisine in which friction is evaluated."""
PASSES = 3
"""Number of evaluations of the motors' motion, each damped by the friction of the previous one."""
POOLED = 15
"""Number of neighbouring lines over which the disturbance is averaged: it has no fine structure over frequency."""
_SAMPLES_PER_LINE = 8


@dataclass(frozen=True)
class ResponseSensors:
    """Encoder `resolution` at the joint (rad) and noise of a torque reading (N m, 1σ), white over the samples of the controller.

    `readings` are those of sensors on the arm, 1σ of a displacement, velocity and acceleration, SI.
    """

    resolution: float = 2 * np.pi / 2**18
    torque_noise: float = 1.0
    readings: tuple[float, float, float] = (1e-6, 5e-5, 0.02)


COMMON_SENSORS = ResponseSensors()
"""Typical sensors: encoders of 18 bits and a torque reading of 1 N m, as default."""


@dataclass(frozen=True, eq=False)
class FrictionDisturbance:
    """Disturbance by Coulomb friction under a multisine and a reference motion.

    `viscous` (E,) N m s/rad is its mean effect on each motor; `power` (L, E) N² m² is E|D|² of the deviation from it in one experiment of
    one realisation, both signs subtracted, as cosine phasors.
    """

    viscous: np.ndarray
    power: np.ndarray

    @classmethod
    def of(cls, robot: RobotModel, system: Linearisation, plan: MultisinePlan) -> FrictionDisturbance:
        """Evaluate friction along the linear motion of the motors about the reference motion, in random realisations of the plan's own.

        With v the motor's velocity by the multisine and V that of the reference, the half difference of the two signs is
        F (sgn(V + v) - sgn(V - v)) / 2 = F sgn(v) where |v| > |V|, else 0.
        """
        axes = [joint.index for joint in robot.driven]
        coulomb = np.nan_to_num(robot.drives.coulomb[axes])
        frequencies, lines = plan.frequencies_hz, np.asarray(plan.lines)
        samples = 1 << int(np.ceil(np.log2(_SAMPLES_PER_LINE * lines.max())))
        time = np.arange(samples) / (samples * plan.base_frequency_hz)
        slow = np.abs(reference_trajectory(plan, time)[1])[:, None, None]
        phasors = np.concatenate([multisine_spectra(plan, draw) for draw in range(DRAWS)], axis=2)
        s = 2j * np.pi * frequencies[:, None, None]
        viscous = np.zeros(len(axes))
        deviation = np.zeros((len(lines), len(axes), phasors.shape[2]), dtype=complex)
        for _ in range(PASSES):
            moved = closed_loop_motion(system, frequencies, plan.kp[axes], plan.kd[axes] + viscous)
            fast = s * (moved[:, : len(axes)] @ phasors)
            velocity = synthesise(fast, lines, samples)
            met = coulomb[:, None] * np.where(np.abs(velocity) > slow, np.sign(velocity), 0.0)
            drag = np.fft.rfft(met, axis=0)[lines] * (2 / samples)
            viscous = np.sum(np.real(drag * fast.conj()), axis=(0, 2)) / np.sum(
                np.abs(fast) ** 2, axis=(0, 2)
            )
            deviation = drag - viscous[:, None] * fast
        power = np.mean(np.abs(deviation) ** 2, axis=2)
        window = np.ones(min(POOLED, len(lines)))
        share = np.convolve(np.ones(len(lines)), window, "same")
        pooled = np.stack([np.convolve(column, window, "same") / share for column in power.T], axis=1)
        return cls(viscous, pooled)

    def thinned(self, step: int) -> FrictionDisturbance:
        """Disturbance at every `step`-th line only."""
        return FrictionDisturbance(self.viscous, self.power[::step])


def equation_error(
    plan: MultisinePlan,
    response: np.ndarray,
    friction: FrictionDisturbance,
    sensors: ResponseSensors,
    orders: Sequence[int] = (),
) -> np.ndarray:
    """Covariance (L, m, m) of the error N_y - G N_u of one experiment, averaged over periods, signs and realisations.

    The m outputs of `response` (L, m, E) are the motors' accelerations, rad/s², and sensors on the arm, which measure derivatives of the
    `orders`.
    Encoder and torque noise average over all samples kept; of the distortion by friction a share is common to all realisations.
    A phasor of white noise of the variance σ² in N samples has the variance 4 σ² / N.
    """
    kept = plan.rate_hz / plan.base_frequency_hz * (plan.periods - plan.settle_periods) * plan.realisations
    noise = 4 / (kept * (2 if plan.signs else 1))
    omega = 2 * np.pi * plan.frequencies_hz
    own = (1 - SHARED_DISTORTION) / plan.realisations + SHARED_DISTORTION
    torque = noise * sensors.torque_noise**2 + own * friction.power
    position = noise * sensors.resolution**2 / 12
    axes = response.shape[-1]
    output = np.zeros((len(omega), axes + len(orders)))
    output[:, :axes] = (position * omega**4)[:, None]
    output[:, axes:] = noise * np.array([sensors.readings[order] ** 2 for order in orders])
    return (
        output[:, :, None] * np.eye(output.shape[1])
        + (response * torque[:, None, :]) @ np.swapaxes(response, 1, 2).conj()
    )
