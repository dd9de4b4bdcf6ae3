"""How large a multisine may be before it pulls a drive across its gap: gravity must hold every drive with backlash to one flank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel, static_equilibrium
from flexcal.model.closed_loop import multisine_torque
from flexcal.model.linearisation import linearise
from flexcal.model.periodic_torque import periodic_torque

CREST = 3.0
"""Peak of a multisine's torque over its root mean square."""
SELDOM = 2.0
"""Standard deviations of a drive's torque that gravity must exceed all along the reference motion: its gap opens seldom, and little."""
LOWEST = 0.2
"""Share of the excitation below which too little would be left to measure with."""
INSTANTS = 32
"""Instants of the reference motion at which the torque of the drives is looked at."""


def drive_torque(model: RobotModel, q: np.ndarray, plan: MultisinePlan) -> np.ndarray:
    """Root mean square (E,) N m of the torque in each elastic drive's spring under one experiment of the plan at `q` (n,)."""
    axes = list(plan.joints)
    system = linearise(model, q, plan.payload)
    excitation = plan.amplitude / np.sqrt(len(axes))
    return multisine_torque(model, system, plan.frequencies_hz, excitation, plan.kp[axes], plan.kd[axes])


def loose_drives(model: RobotModel, plan: MultisinePlan) -> list[int]:
    """The numbers of the excited axes that have backlash."""
    return [k for k, joint in enumerate(plan.joints) if joint in model.backlash_joints]


def share_at_rest(model: RobotModel, plan: MultisinePlan) -> float:
    """The share of the excitation at which its peaks in every pose stay below what gravity puts on the drives with backlash.

    The reference motion is left out, as in the paper. Above 1 where there is room.
    """
    held = np.abs(static_equilibrium(model, plan.poses, plan.payload).torque[:, list(plan.joints)])
    swing = CREST * np.array([drive_torque(model, q, plan) for q in plan.poses])
    return float((held / swing)[:, loose_drives(model, plan)].min(initial=np.inf))


def share_in_motion(model: RobotModel, q: np.ndarray, plan: MultisinePlan) -> float:
    """The share of the excitation at which gaps at `q` (n,) open seldom all along the reference motion, and with peaks not at rest.

    0 where the reference motion alone opens one; inf without backlash.
    """
    drives = loose_drives(model, plan)
    if not drives:
        return np.inf
    omega = 2 * np.pi * plan.reference_frequency_hz
    angle = 2 * np.pi * np.arange(INSTANTS)[:, None] / INSTANTS
    excited = np.isin(np.arange(model.n), plan.joints) * plan.reference_amplitude
    motion = (
        q + excited * np.sin(angle),
        excited * omega * np.cos(angle),
        -excited * omega**2 * np.sin(angle),
    )
    held = periodic_torque(model, *motion, period=2 * np.pi / omega, payload=plan.payload)
    held = held[:, [plan.joints[k] for k in drives]]
    least = np.where((held > 0).all(axis=0) | (held < 0).all(axis=0), np.abs(held).min(axis=0), 1e-9)
    needed = np.maximum(SELDOM / least, CREST / np.abs(held.mean(axis=0)))
    return float(1 / (needed * drive_torque(model, q, plan)[drives]).max())


def within_preload(model: RobotModel, plan: MultisinePlan) -> MultisinePlan:
    """The plan, its amplitudes lowered on all axes alike until `share_in_motion` is 1 or more in every pose.

    Raises `FlexcalError` where the reference motion alone opens a gap.
    """
    shares = [share_in_motion(model, q, plan) for q in plan.poses]
    if min(shares) < LOWEST:
        raise FlexcalError(
            f"pose {int(np.argmin(shares)) + 1} does not load the drives with backlash enough: their gaps would stay closed only with "
            f"{100 * min(shares):.0f} % of the excitation; choose another pose or a smaller reference motion."
        )
    return replace(plan, amplitude=min(1.0, *shares) * plan.amplitude)
