"""Feed-forward of the hard cell's controller: the rigid robot of the files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.hard_cell.description import ArmDescription
from flexcal.hard_cell.drawn import ideal_robot
from flexcal.hard_cell.multibody import build

COULOMB_VELOCITY = 0.01  # rad/s: where the controller's compensation of Coulomb friction turns over


def rigid_torque(
    described: ArmDescription, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, payload: float
) -> np.ndarray:
    """Torque (N, n) N m of the motors that moves the described arm, rigid and without friction, by `q`, `dq`, `ddq` (N, n)."""
    import mujoco

    rigid = ideal_robot(replace(described, springs=np.full_like(described.springs, np.inf)))
    arm = build(rigid, payload=payload)
    data, torque = arm.data, np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(arm.mjmodel, data)
        torque[k] = data.qfrc_inverse
    return torque


def friction(described: ArmDescription, rate: np.ndarray) -> np.ndarray:
    """Viscous and Coulomb friction (N, n) N m of the described drives at rates (N, n) rad/s."""
    return described.viscous * rate + described.coulomb * np.tanh(rate / COULOMB_VELOCITY)
