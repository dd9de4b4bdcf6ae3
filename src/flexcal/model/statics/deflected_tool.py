"""Tool position of the deflected, calibrated robot at rest: the forward map of calibration and compensation."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics import (
    PointKinematics,
    depends_on_temperature,
    expanded,
    point_ends,
    point_kinematics,
    temperature_rise,
)
from flexcal.model.robot import RobotModel
from flexcal.model.statics.applied_force import force_moments, under_force
from flexcal.model.statics.equilibrium import Equilibrium, static_equilibrium
from flexcal.model.statics.transmission import transmission_slopes


@dataclass(frozen=True, eq=False)
class ToolAtRest:
    """Targets of the resting arm at a batch of motor positions `q` (N, n), in the robot's base frame, and the arm's equilibrium."""

    model: RobotModel
    q: np.ndarray
    rest: Equilibrium
    kinematics: PointKinematics

    def command_jacobian(self) -> np.ndarray:
        """∂(position, rotation)/∂q (N, 6, n), m and rad per rad or m, on the same flank: with jacobians only.

        The deflection follows the command (its gravity load changes); what `gravity_compliance` adds to that, some 1e-4, is left out.
        """
        by_motion = self.kinematics.motion_jacobian
        axes = self.rest.axes
        by_joint = by_motion[:, :, :, 2].copy()
        if len(axes):
            by_load = np.matmul(by_motion[:, :, axes[:, 0], axes[:, 1]], self.rest.compliance)
            by_joint -= np.matmul(by_load, self.rest.by_offset)
        return by_joint @ transmission_slopes(self.model, self.q)


def carried_mass(model: RobotModel, payload: np.ndarray | None, samples: int) -> np.ndarray:
    """Payload mass (N,), kg, from a file's `payload` (N,); the declared mass where the file has none.

    Where the payload was found to weigh more or less than declared, the values of the file are as much off. Raises `FlexcalError` for a
    payload without a declaration.
    """
    declared = model.payload
    if payload is None:
        return np.full(samples, model.payload_mass)
    if payload.any() and declared is None:
        raise FlexcalError(
            "E-MODEL-004",
            f"the poses name a payload but {model.path} declares none; add `payload:` with its centre of mass.",
        )
    if declared is None or declared.nominal_mass == 0:
        return payload * 1.0
    return payload * (declared.mass / declared.nominal_mass)


def tool_at_rest(
    model: RobotModel,
    q: np.ndarray,
    payload: np.ndarray | None,
    target: np.ndarray,
    *,
    flank: np.ndarray | None = None,
    elastic: bool = True,
    jacobians: bool = False,
    parameters: bool = True,
    force: np.ndarray | None = None,
    temperature: np.ndarray | None = None,
    approach: np.ndarray | None = None,
) -> ToolAtRest:
    """Pose of measured points on the robot at rest, deflected by gravity and payload.

    Parameters
    ----------
    model : RobotModel
        The robot, calibrated or not.
    q : ndarray
        Motor positions (N, n) referred to the joints, rad or m.
    payload : ndarray, optional
        Payload (N,), kg, at the declared payload's centre of mass, as `carried_mass` takes it; by default as declared.
    target : ndarray
        Names (N,) of the points.
    flank : ndarray, optional
        Side of every backlash (N, n), ±1; by default the drive torque at rest decides.
    elastic : bool
        Whether the arm deflects; without, it is rigid.
    jacobians : bool
        Whether derivatives are computed too.
    parameters : bool
        Whether those by the robot's parameters are among them; `ToolAtRest.command_jacobian` does without.
    force : ndarray, optional
        Force (N, 3), N in the base frame, on the points; none by default.
    temperature : ndarray, optional
        Temperature (N,) of the arm, °C; by default that at which the robot's parameters hold.
    approach : ndarray, optional
        Signs (N, n) of the last motion of each motor, behind which the arm lags by half the width of its hysteresis; by default unknown
        (0), and the arm is in the middle.

    Returns
    -------
    ToolAtRest
        `kinematics.position` (N, 3), m, and `kinematics.orientation` (N, 3, 3) in the base frame, and the equilibrium `rest`.

    Raises
    ------
    FlexcalError
        For an unknown point, and as `static_equilibrium` does.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import RobotModel, tool_at_rest
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> q = np.array([[0, -0.5, 1.6, 0, 0.6, 0]])
    >>> deflected = tool_at_rest(model, q, None, np.array(["smr"]))
    >>> rigid = tool_at_rest(model, q, None, np.array(["smr"]), elastic=False)
    >>> (deflected.kinematics.position - rigid.kinematics.position).shape
    (1, 3)
    """
    masses = carried_mass(model, payload, len(q))
    if force is None:
        rest = static_equilibrium(
            model, q, masses, flank=flank, elastic=elastic, sensitivities=jacobians, parameters=parameters
        )
    else:
        rest = _pulled(model, q, masses, target, force, flank, elastic=elastic)
    if approach is not None and model.drives.hysteresis.any():
        lagging = rest.deflection.copy()
        lagging[:, list(model.motors), 2] -= approach * model.drives.hysteresis[list(model.motors)]
        rest = replace(rest, deflection=lagging)
    if temperature is None or not depends_on_temperature(model):
        at = points_kinematics(model, q, rest.deflection, target, jacobians=jacobians, parameters=parameters)
        return ToolAtRest(model, q, rest, at)
    rise = temperature_rise(model, temperature)
    bent = rest.deflection.copy()
    bent[:, :, 2] += np.outer(rise, model.thermal.zero_drift)
    ends = point_ends(model, target)
    at = points_kinematics(model, q, bent, target, jacobians=jacobians, parameters=parameters)
    return ToolAtRest(model, q, replace(rest, deflection=bent), expanded(model, q, at, target, ends, rise))


def _pulled(
    model: RobotModel,
    q: np.ndarray,
    masses: np.ndarray,
    target: np.ndarray,
    force: np.ndarray,
    flank: np.ndarray | None,
    *,
    elastic: bool,
) -> Equilibrium:
    """Equilibrium under gravity and a force on the points, on the flanks of both together where none are given."""
    rest = static_equilibrium(model, q, masses, flank=flank, elastic=elastic, sensitivities=True)
    at = points_kinematics(model, q, rest.deflection, target, jacobians=True)
    moments = force_moments(at, force)
    if flank is None and model.backlash_joints:
        sides = np.sign(rest.torque - moments[:, :, 2])
        if (sides != np.sign(rest.torque))[:, list(model.backlash_joints)].any():
            rest = static_equilibrium(model, q, masses, flank=sides, elastic=elastic, sensitivities=True)
    return under_force(model, q, rest, moments)


def points_kinematics(
    model: RobotModel,
    q: np.ndarray,
    deflection: np.ndarray | None,
    target: np.ndarray,
    *,
    jacobians: bool,
    parameters: bool = True,
) -> PointKinematics:
    """`point_kinematics` with a different point (N,) in every row."""
    names = list(dict.fromkeys(target.tolist()))
    if len(names) < 2:
        return point_kinematics(
            model, q, deflection, point=next(iter(names), None), jacobians=jacobians, parameters=parameters
        )
    rows = [np.flatnonzero(target == name) for name in names]
    moved = [None if deflection is None else deflection[own] for own in rows]
    parts = [
        point_kinematics(model, q[own], bent, point=name, jacobians=jacobians, parameters=parameters)
        for name, own, bent in zip(names, rows, moved, strict=True)
    ]
    order = np.argsort(np.concatenate(rows), kind="stable")

    def joined(field: str) -> np.ndarray:
        stacked = np.concatenate([getattr(part, field) for part in parts])
        return stacked[order] if len(stacked) else stacked

    return PointKinematics(**{field.name: joined(field.name) for field in fields(PointKinematics)})
