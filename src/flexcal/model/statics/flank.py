"""Flank of a backlash under gravity, and its certainty."""

from __future__ import annotations

import numpy as np

from flexcal.model.robot import MASS_AND_COM, RobotModel
from flexcal.model.statics.equilibrium import gravity_regressor, payload_batch
from flexcal.units import FELT

CERTAIN = 3.0
"""Distance of a drive torque from zero, in standard deviations, from which its sign counts as certain."""


def certain_flank(
    model: RobotModel, q: np.ndarray, torque: np.ndarray, payload: np.ndarray | float | None = None
) -> np.ndarray:
    """Mask (samples, N) of drives whose gravity `torque` (samples, N) N m at `q` (samples, n) has a certain sign."""
    return np.abs(torque) > CERTAIN * gravity_torque_std(model, q, payload)


def are_flanks_certain(
    model: RobotModel, q: np.ndarray, torque: np.ndarray, payload: np.ndarray | float | None = None
) -> np.ndarray:
    """Mask (samples,) of configurations in which every joint with backlash is on a certain flank, as in `certain_flank`.

    A joint whose backlash was estimated, and moves no point by more than the best robots repeat to, may be on either.
    """
    joints = [i for i in model.backlash_joints if _is_felt(model, f"{model.joints[i].name}.backlash")]
    return np.all(certain_flank(model, q, torque, payload)[:, joints], axis=1)


def _is_felt(model: RobotModel, name: str) -> bool:
    """Whether a backlash may move a point at the reach of the arm by more than the best robots repeat to; unknown ones may."""
    return name not in model.posterior.parameters or 2 * model.value(name) * model.reach > FELT


def gravity_torque_std(
    model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None
) -> np.ndarray:
    """Standard deviation (samples, N), N m, of the gravity torque at `q` (samples, n), to first order.

    From the covariance of masses and centres of mass: that of the model's posterior where they were estimated, else independent ones as
    `prior:` and the payload's `mass_std` say. `payload` (samples,) or a scalar in kg at the declared payload's centre of mass.
    Prismatic joints read 0.
    """
    masses = payload_batch(model, payload, len(q))
    regressor = gravity_regressor(model, q, masses).reshape(len(q), len(model.joints), len(model.joints), 4)
    names: list[str] = []
    rows: list[np.ndarray] = []
    declared: list[float] = []
    for k, joint in enumerate(model.joints):
        names += [f"{joint.link}.{key}" for key in MASS_AND_COM]
        rows.append(regressor[:, :, k, 0] + regressor[:, :, k, 1:] @ model.links.com[k])
        rows += [model.links.mass[k] * regressor[:, :, k, c] for c in (1, 2, 3)]
        declared += [model.prior.mass * model.links.mass[k], *[model.prior.com] * 3]
    declared_payload = model.payload
    if declared_payload is not None and declared_payload.mass > 0:
        own = regressor[:, :, declared_payload.joint]
        names += ["payload.mass", "payload.com_x", "payload.com_y", "payload.com_z"]
        rows.append(
            (masses / declared_payload.mass)[:, None]
            * (own[:, :, 0] + own[:, :, 1:] @ declared_payload.com_in_link)
        )
        rows += [masses[:, None] * (own[:, :, 1:] @ declared_payload.rotation[:, c]) for c in range(3)]
        declared += [declared_payload.mass_std, 0.0, 0.0, 0.0]
    covariance = np.diag(np.square(declared))
    known = [i for i, name in enumerate(names) if model.posterior.determines(name)]
    parameters = model.posterior.parameters.subset([names[i] for i in known])
    slopes = parameters.natural_slope(parameters.coordinates())
    covariance[np.ix_(known, known)] = model.posterior.marginal(parameters.names) * np.outer(slopes, slopes)
    slope = np.stack(rows, axis=2)
    return np.sqrt(np.sum(np.matmul(slope, covariance) * slope, axis=2))
