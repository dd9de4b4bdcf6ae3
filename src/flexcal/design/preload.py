"""On which flank of its backlash gravity presses a joint, and how surely."""

from __future__ import annotations

import numpy as np

from flexcal.design.joint_space import even_configurations
from flexcal.design.skeleton import link_frames
from flexcal.model import RobotModel, gravity_torque
from flexcal.model.equilibrium import payload_batch

LEAST_TORQUE = 10.0
"""N m of gravity below which a backlash does not count as preloaded."""
LEAST_SHARE = 0.05
"""Share of the largest gravity torque of the joint below which a backlash does not count as preloaded."""
LEAST_SIGMAS = 3.0
"""Standard deviations of the gravity torque below which a backlash does not count as preloaded."""


def preload_joints(model: RobotModel) -> tuple[int, ...]:
    """The revolute joints that are declared to have backlash."""
    return tuple(i for i in model.backlash_joints if model.joints[i].kind == "revolute")


def gravity_torque_std(model: RobotModel, q: np.ndarray, payload: float | None = None) -> np.ndarray:
    """Standard deviation (samples, n), N m, of the gravity torque at `q` (samples, n) when inertials are as uncertain as `prior:` says.

    First order: τ_i = aᵢ·Σ mₖ (cₖ - oᵢ) × g over the links k beyond joint i; masses and the coordinates of the centres of mass are
    independent, the payload's mass has `mass_std`. `payload` in kg at the declared payload's centre of mass.
    """
    rotation, origin = link_frames(model, q)
    mass = payload_batch(model, payload, len(q))[0] if len(q) else 0.0
    variance = np.zeros((len(q), model.n))
    held = model.payload
    beyond = _beyond(model)
    for i, joint in enumerate(model.joints):
        if joint.kind != "revolute":
            continue
        axis = rotation[:, i] @ joint.axis
        lever = np.cross(model.gravity, axis)
        for k in np.flatnonzero(beyond[i]):
            centre = origin[:, k] + rotation[:, k] @ model.com[k]
            by_mass = np.einsum("si,si->s", centre - origin[:, i], lever)
            variance[:, i] += (model.prior.mass * model.mass[k] * by_mass) ** 2
            variance[:, i] += (model.prior.com * model.mass[k]) ** 2 * np.einsum("si,si->s", lever, lever)
        if held is not None and beyond[i, held.joint] and mass > 0:
            centre = origin[:, held.joint] + rotation[:, held.joint] @ held.com_in_link
            variance[:, i] += (held.mass_std * np.einsum("si,si->s", centre - origin[:, i], lever)) ** 2
    return np.sqrt(variance)


def preloaded(model: RobotModel, q: np.ndarray, payload: float | None = None) -> np.ndarray:
    """Whether gravity surely settles the flank of every joint with backlash at `q` (samples, n), as (samples,) of bool.

    Its torque must exceed 10 N m, 5 % of its largest over the joint ranges, and three of its own standard deviations.
    """
    joints = list(preload_joints(model))
    if not joints or not len(q):
        return np.ones(len(q), dtype=bool)
    torque = np.abs(gravity_torque(model, q, payload))[:, joints]
    sure = LEAST_SIGMAS * gravity_torque_std(model, q, payload)[:, joints]
    largest = np.abs(gravity_torque(model, even_configurations(model, 1000), payload))[:, joints].max(axis=0)
    least = np.maximum(LEAST_TORQUE, LEAST_SHARE * largest)
    return np.all(torque > np.maximum(sure, least), axis=1)


def _beyond(model: RobotModel) -> np.ndarray:
    """(n, n) of bool: whether link k (column) moves with joint i (row)."""
    result = np.eye(model.n, dtype=bool)
    for k, joint in enumerate(model.joints):
        if joint.parent >= 0:
            result[:, k] |= result[:, joint.parent]
    return result
