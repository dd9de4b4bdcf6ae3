"""The elastic arm at rest: deflection under gravity with the motors held (Eqs. 10-14), backlash flanks, sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_batch
from flexcal.model.robot_model import RobotModel


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Rest positions of a batch of poses (n joints, d elastic coordinates, E elastic joints).

    `deflection` (samples, n, 3) rad: tilt about x, about y, and twist of the arm beyond the motor, backlash included; `torque`
    (samples, n) N m of the motor on the arm that holds gravity; `flank` (samples, n) its sign where the joint has backlash, else 0;
    `axes` (d, 2) joint and component of each elastic coordinate; `compliance` (samples, d, d) rad/(N m), the inverse of spring plus
    gravity stiffness; `regressor` (samples, d, 4 n): the gravity load on each coordinate by mass and first moment of each link;
    `coupling` (samples, d, 6 n) the same by offset, misalignments and lengths of every joint. The last three are empty
    without sensitivities.
    """

    deflection: np.ndarray
    torque: np.ndarray
    flank: np.ndarray
    axes: np.ndarray
    compliance: np.ndarray
    regressor: np.ndarray
    coupling: np.ndarray


def elastic_axes(model: RobotModel) -> list[tuple[int, int]]:
    """Elastic coordinates from base to tool as (joint, component): 2 twist, 1 tilt about y, 0 tilt about x."""
    return [(e.index, c) for e in model.elastic for c in e.components]


def payload_batch(model: RobotModel, payload: np.ndarray | float | None, samples: int) -> np.ndarray:
    """Payload mass per pose (samples,), kg: the declared one where None; raises `FlexcalError` without a declared payload."""
    if payload is None:
        return np.full(samples, model.payload_mass[0])
    masses = np.ascontiguousarray(np.broadcast_to(np.asarray(payload, dtype=float), (samples,)))
    if model.nominal_payload is None and masses.any():
        raise FlexcalError(
            f"a payload is given but {model.path} declares none; add `payload:` with its frame and centre of mass."
        )
    return masses


def _solve(
    model: RobotModel,
    axes: list[tuple[int, int]],
    stiffness: np.ndarray,
    q: np.ndarray,
    payload: np.ndarray,
    *,
    sensitivities: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Elastic deflection (samples, n, 3), compliance, regressor and coupling of `Equilibrium`."""
    held = model.payload
    try:
        deflection, compliance, regressor, coupling, step = model.tree.equilibrium(
            axes,
            np.ascontiguousarray(stiffness, dtype=float),
            np.ascontiguousarray(model.geometry),
            np.ascontiguousarray(model.mass),
            np.ascontiguousarray(model.mass[:, None] * model.com),
            payload,
            held.joint if held else -1,
            np.ascontiguousarray(held.com_in_link if held else np.zeros(3)),
            model.gravity,
            q,
            sensitivities,
        )
    except ValueError as problem:
        raise FlexcalError(
            f"{model.name}: {problem}; check the stiffnesses in robot.yaml and the payload."
        ) from problem
    if step > 1e-9:
        raise FlexcalError(
            f"{model.name}: no rest position was found (last step {step:.1e} rad); check the stiffnesses."
        )
    return deflection, compliance, regressor, coupling


def gravity_torque(model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None) -> np.ndarray:
    """Torque (samples, n), N m, that the drives must hold against gravity on the undeflected robot; `payload` (samples,) in kg.

    Found by putting a spring of unbounded stiffness in every joint; prismatic joints read 0.
    """
    q = joint_batch(model, q)
    axes = [(i, 2) for i, joint in enumerate(model.joints) if joint.kind == "revolute"]
    payload = payload_batch(model, payload, len(q))
    rigid = 1e15
    deflection = _solve(model, axes, np.full(len(axes), rigid), q, payload, sensitivities=False)[0]
    return -rigid * deflection[:, :, 2]


def static_equilibrium(
    model: RobotModel,
    q: np.ndarray,
    payload: np.ndarray | float | None = None,
    *,
    flank: np.ndarray | None = None,
    elastic: bool = True,
    sensitivities: bool = False,
) -> Equilibrium:
    """Rest position of every pose for motors held at `q` (samples, n), to 1e-12 rad.

    `payload` (samples,) or a scalar in kg at the declared payload's centre of mass; None takes the declared mass. `flank` (samples, n)
    overrides the sign of the drive torque that places the arm in the backlash (q_arm = q_M - τ/c - b sign τ, b half the gap). Without
    `elastic` the arm is rigid and only backlash and gravity compliance displace it. Raises `FlexcalError` where springs cannot carry
    the arm.
    """
    q = joint_batch(model, q)
    masses = payload_batch(model, payload, len(q))
    load = gravity_torque(model, q, masses)
    axes = elastic_axes(model) if elastic else []
    slack = -np.sign(load) * model.backlash if flank is None else -flank * model.backlash
    slack = slack - load * model.gravity_compliance + transmission_error(model, q)
    stiffness = np.array([model.stiffness[a] for a in axes])
    if not (np.isfinite(stiffness) & (stiffness > 0)).all():
        raise FlexcalError(
            f"{model.name}: every stiffness must be positive and finite, not {stiffness.min():g} N m/rad."
        )
    deflection, *derivatives = _solve(model, axes, stiffness, q + slack, masses, sensitivities=sensitivities)
    for i, component in axes:
        if component == 2:
            load[:, i] = -model.stiffness[i, 2] * deflection[:, i, 2]
    deflection[:, :, 2] += slack
    sign = np.sign(load) if flank is None else flank
    has_backlash = np.isin(np.arange(model.n), model.backlash_joints)
    return Equilibrium(
        deflection, load, sign * has_backlash, np.array(axes, dtype=int).reshape(-1, 2), *derivatives
    )


def transmission_error(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Harmonic transmission error (samples, n), rad: Σ a_k sin(k q) + b_k cos(k q)."""
    phase = q[:, :, None] * np.array(model.harmonics)
    return (model.transmission[:, :, 0] * np.sin(phase) + model.transmission[:, :, 1] * np.cos(phase)).sum(
        axis=2
    )
