"""Largest multisine amplitude at which gravity holds every drive with backlash on one flank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium
from flexcal.model.vibration import linearise, periodic_torque, strain_power

CREST = 3.0
"""Assumed crest factor of a multisine's torque."""
SELDOM = 2.0
"""Least ratio of gravity torque to the standard deviation of a drive's torque along the reference motion: its gap opens seldom, and
little.
"""
LOWEST = 0.2
"""Least share of the excitation sufficient for a measurement."""
INSTANTS = 16
"""Number of instants of the reference motion at which the drive torques are evaluated."""


def static_amplitude_share(model: RobotModel, plan: MultisinePlan) -> float:
    """Share of the excitation at which its peaks in every pose stay below the gravity torque of drives with backlash.

    The reference motion is left out, as in the paper. Above 1 where there is room.
    """
    drives = _loose(model, plan)
    gravity = np.abs(
        static_equilibrium(model, plan.poses, plan.payload).torque[:, [plan.joints[k] for k in drives]]
    )
    power = np.sum([_strain(model, q, plan)[drives] * plan.amplitude**2 for q in plan.poses], axis=(2, 3))
    return float((gravity / (CREST * np.sqrt(power))).min(initial=np.inf))


def backlash_load(model: RobotModel, q: np.ndarray, plan: MultisinePlan) -> np.ndarray:
    """Derivative (drives, E, L) of the squared relative load of each gap at `q` (n,) by the squared amplitude of each line, per N² m².

    Where the sum over the lines is 1, gravity just exceeds three standard deviations of the drive's torque at rest, or two all along the
    reference motion, whichever takes more. Of the drives with backlash, in their order.
    """
    drives = _loose(model, plan)
    omega = 2 * np.pi * plan.reference_frequency_hz
    angle = 2 * np.pi * np.arange(INSTANTS)[:, None] / INSTANTS
    excited = np.isin(np.arange(model.n), plan.joints) * plan.reference_amplitude
    motion = (
        q + excited * np.sin(angle),
        excited * omega * np.cos(angle),
        -excited * omega**2 * np.sin(angle),
    )
    period = 1 / plan.reference_frequency_hz if omega else 1.0
    torque = periodic_torque(model, *motion, period=period, payload=plan.payload)
    torque = torque[:, [plan.joints[k] for k in drives]]
    still = static_equilibrium(model, q[None], plan.payload).torque[0, [plan.joints[k] for k in drives]]
    one_sided = (torque > 0).all(axis=0) | (torque < 0).all(axis=0)
    least = np.where(one_sided, np.abs(torque).min(axis=0), 0.0)
    with np.errstate(divide="ignore"):
        needed = np.maximum(SELDOM / least, CREST / np.abs(still))
    return _strain(model, q, plan)[drives] * needed[:, None, None] ** 2


def amplitude_share(load: np.ndarray, amplitude: np.ndarray) -> float:
    """Share of `amplitude` (E, L) N m that loads no gap beyond its limit; `load` (..., E, L) is that of `backlash_load`.

    0 where the reference motion alone opens a gap; inf without backlash.
    """
    strained = np.sum(load * amplitude**2, axis=(-2, -1))
    return float(1 / np.sqrt(strained.max())) if strained.size else np.inf


def within_preload(model: RobotModel, plan: MultisinePlan) -> MultisinePlan:
    """Plan with amplitudes reduced equally on all axes until no gap is loaded beyond its limit in any pose.

    Raises `FlexcalError` where next to nothing would be left, naming the pose.
    """
    shares = [amplitude_share(backlash_load(model, q, plan), plan.amplitude) for q in plan.poses]
    if min(shares) < LOWEST:
        raise FlexcalError(
            "E-DESIGN-001",
            f"gravity does not load the drives with backlash in pose {int(np.argmin(shares)) + 1} enough: their gaps would stay closed "
            f"only with {100 * min(shares):.0f} % of the excitation; choose another pose or a smaller reference motion.",
        )
    return replace(plan, amplitude=min(1.0, *shares) * plan.amplitude)


def _loose(model: RobotModel, plan: MultisinePlan) -> list[int]:
    """Indices of the excited axes with backlash."""
    return [k for k, joint in enumerate(plan.joints) if joint in model.backlash_joints]


def _strain(model: RobotModel, q: np.ndarray, plan: MultisinePlan) -> np.ndarray:
    """Mean square (E, E, L) of the torque in each drive's spring by 1 N m of amplitude, in one experiment: axes share it evenly."""
    axes = list(plan.joints)
    system = linearise(model, q, plan.payload)
    power = strain_power(model, system, plan.frequencies_hz, plan.kp[axes], plan.kd[axes])
    return np.moveaxis(power, 0, -1) / len(axes)
