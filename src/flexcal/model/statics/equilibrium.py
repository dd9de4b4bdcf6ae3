"""Static equilibrium of the elastic arm: deflection under gravity with the motors held (Eqs. 10-14), backlash flanks, sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_batch, joint_positions
from flexcal.model.robot import RobotModel
from flexcal.model.statics.hardening import tangent_ratio, twist_from_torque
from flexcal.model.statics.related_equilibrium import related_equilibrium
from flexcal.model.statics.transmission import transmission_error


def lateral_axes(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Axes of `misalignment_1` and `misalignment_2` (samples, N, 2, 2) at `q` (samples, n), by their components on the tilt axes x and y.

    The former are fixed to the parent link; the latter turn with the joint, but for `bearings: before`. Zero for prismatic joints.
    """
    from flexcal.model.parts import bearing_frame

    q = joint_positions(model, q)
    result = np.zeros((*q.shape, 2, 2))
    motion = q + model.geometry.errors[:, 0] if model.bearings == "after" else np.zeros(q.shape)
    cosine, sine = np.cos(motion), np.sin(motion)
    for i, joint in enumerate(model.joints):
        if joint.kind != "revolute":
            continue
        frame = model.springs.bearing_frames.get(i)
        x, y = (joint.normals @ (bearing_frame(joint) if frame is None else frame))[:, :2].T
        result[:, i, :, 0] = np.outer(cosine[:, i], x) + np.outer(sine[:, i], y)
        result[:, i, :, 1] = np.outer(cosine[:, i], y) - np.outer(sine[:, i], x)
    return result


_FLANK_PASSES = 5
_RIGID = 1e17


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Rest positions of a batch of poses (N joints, d elastic coordinates, G geometric errors).

    `deflection` (samples, N, 3) rad: tilt about x, about y, and twist of the arm beyond the motor, or beyond the relation of a joint
    without one, backlash included; `torque` (samples, N) N m of the motor, or what stands in its place, on the arm that holds gravity;
    `flank` (samples, N) the side of its backlash that the arm rests on, the sign of that torque, 0 where there is none; `axes` (d, 2)
    joint and component of each elastic coordinate; `compliance` (samples, d, d) rad/(N m), the inverse of spring plus gravity stiffness;
    `by_offset` (samples, d, N): the gravity load on each coordinate by the offset of each joint; `regressor` (samples, d, 4 N) the same by
    mass and first moment of each link; `coupling` (samples, d, G) by the errors of `RobotModel.geometry_columns`. The last four are
    empty without sensitivities, the last two without those by parameters.
    """

    deflection: np.ndarray
    torque: np.ndarray
    flank: np.ndarray
    axes: np.ndarray
    compliance: np.ndarray
    by_offset: np.ndarray
    regressor: np.ndarray
    coupling: np.ndarray


def elastic_axes(model: RobotModel) -> list[tuple[int, int]]:
    """Elastic coordinates from base to tool as (joint, component): 2 twist, 1 tilt about y, 0 tilt about x."""
    return [(e.index, c) for e in model.elastic for c in e.components]


def payload_batch(model: RobotModel, payload: np.ndarray | float | None, samples: int) -> np.ndarray:
    """Payload mass per pose (samples,), kg: the declared one where None; raises `FlexcalError` without a declared payload."""
    if payload is None:
        return np.full(samples, model.payload_mass)
    masses = np.ascontiguousarray(np.broadcast_to(np.asarray(payload, dtype=float), (samples,)))
    if model.payload is None and masses.any():
        raise FlexcalError(
            "E-MODEL-005",
            f"a payload is given but {model.path} declares none; add `payload:` with its frame and centre of mass.",
        )
    return masses


def _solve(
    model: RobotModel,
    axes: list[tuple[int, int]],
    stiffness: np.ndarray,
    q: np.ndarray,
    slack: np.ndarray,
    payload: np.ndarray,
    *,
    sensitivities: bool,
    parameters: bool = True,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Elastic deflection (samples, N, 3) beside `slack` (samples, N), compliance, by_offset, regressor and coupling of `Equilibrium`."""
    samples, joints = len(q), len(model.joints)
    if not axes:
        deflection, by_offset = np.zeros((samples, joints, 3)), np.zeros((samples, 0, joints))
        regressor = np.zeros((samples, 0, 4 * joints))
        coupling = np.zeros((samples, 0, len(model.geometry_columns)))
        return deflection, np.zeros((samples, 0, 0)), by_offset, regressor, coupling
    try:
        if model.relations is None:
            deflection, compliance, by_offset, regressor, coupling, step = _independent(
                model, axes, stiffness, q, slack, payload, sensitivities=sensitivities, parameters=parameters
            )
        else:
            deflection, compliance, regressor, coupling, step = related_equilibrium(
                model, axes, stiffness, q, slack, payload, sensitivities=sensitivities
            )
            by_offset = coupling[:, :, : 6 * joints : 6]
    except ValueError as problem:
        raise FlexcalError(
            "E-MODEL-006", f"{model.name}: {problem}; {_to_check(model, axes, stiffness, payload)}."
        ) from problem
    if step > 1e-9:
        raise FlexcalError(
            "E-MODEL-007",
            f"{model.name}: no stable equilibrium was found (last step {step:.1e} rad); check the stiffnesses.",
        )
    return deflection, compliance, by_offset, regressor, coupling


def _to_check(
    model: RobotModel, axes: list[tuple[int, int]], stiffness: np.ndarray, payload: np.ndarray
) -> str:
    """Where the softest spring and the largest payload come from, and that these are to be checked."""
    softest = int(np.argmin(stiffness))
    joint, part = model.joints[axes[softest][0]].name, ("bearing_x", "bearing_y", "drive")[axes[softest][1]]
    value = float(stiffness[softest])
    declared = next((getattr(entry, part) for entry in model.config.elastic if entry.joint == joint), None)
    if declared is None:
        origin = "by the estimates, where robot.yaml declares none"
    elif np.isclose(declared.stiffness, value, rtol=1e-6):
        origin = "in robot.yaml"
    else:
        origin = f"by the estimates, {declared.stiffness:.3g} in robot.yaml"
    spring = f"the softest spring, {part} of {joint}, has {value:.3g} N m/rad {origin}"
    heaviest = float(np.max(payload, initial=0.0))
    load = f", and the payload is {heaviest:.4g} kg" if heaviest > 0 else ""
    if heaviest > 0 and not np.isclose(heaviest, model.payload_mass):
        load += f", where robot.yaml declares {model.payload_mass:.4g}"
    return f"{spring}{load}; check these, and the masses of the links"


def _independent(
    model: RobotModel,
    axes: list[tuple[int, int]],
    stiffness: np.ndarray,
    q: np.ndarray,
    slack: np.ndarray,
    payload: np.ndarray,
    *,
    sensitivities: bool,
    parameters: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """As `_solve`, of a robot whose joints all have motors, and the last step, rad."""
    declared = model.payload
    return model.tree.equilibrium(
        axes,
        np.ascontiguousarray(stiffness, dtype=float),
        np.ascontiguousarray(model.geometry.errors),
        np.ascontiguousarray(model.links.mass),
        np.ascontiguousarray(model.links.mass[:, None] * model.links.com),
        payload,
        declared.joint if declared else -1,
        np.ascontiguousarray(declared.com_in_link if declared else np.zeros(3)),
        model.gravity,
        q + slack,
        sensitivities,
        parameters,
    )


def gravity_torque(model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None) -> np.ndarray:
    """Drive torque that balances gravity, on the undeflected robot.

    Computed with a spring of unbounded stiffness in every joint.

    Parameters
    ----------
    model : RobotModel
        The robot.
    q : ndarray
        Motor positions (N, n) referred to the joints, rad or m.
    payload : ndarray or float, optional
        Payload (N,), kg, at the declared payload's centre of mass; by default as declared.

    Returns
    -------
    ndarray
        Torques (N, joints), N m, of the motor of every joint, or of what stands in its place; zero for prismatic joints.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import RobotModel, gravity_torque
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> gravity_torque(model, np.array([[0, -0.5, 1.6, 0, 0.6, 0]])).shape
    (1, 6)
    """
    _, deflection, _, _ = _held_rigidly(model, q, payload, _twists(model), sensitivities=False)
    return -_RIGID * deflection[:, :, 2]


def gravity_moments(
    model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None
) -> np.ndarray:
    """Moments (samples, N, 2), N m, of joints balancing gravity about their axes of `misalignment_1` and `misalignment_2`.

    As `gravity_torque` otherwise: of the undeflected robot, carrying everything beyond the joint; 0 for prismatic joints.
    """
    q = joint_batch(model, q)
    tilts = [(i, component) for i, _ in _twists(model) for component in (1, 0)]
    _, deflection, _, _ = _held_rigidly(model, q, payload, tilts, sensitivities=False)
    return np.matmul(lateral_axes(model, q), -_RIGID * deflection[:, :, :2, None])[:, :, :, 0]


def lateral_slopes(model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None) -> np.ndarray:
    """Tilt (samples, N, 2, 2) of every joint due to its two lateral compliances, about the tilt axes x and y (last), rad per rad/(N m).

    Minus the moment that holds gravity, about an axis that is fixed to the parent link.
    """
    return -gravity_moments(model, q, payload)[:, :, :, None] * lateral_axes(model, joint_batch(model, q))


def gravity_regressor(
    model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None
) -> np.ndarray:
    """Derivative (samples, N, 4 N) of `gravity_torque` with respect to mass and first moment of each link, payload included."""
    axes = _twists(model)
    _, deflection, regressor, _ = _held_rigidly(model, q, payload, axes, sensitivities=True)
    joints = len(model.joints)
    result = np.zeros((len(deflection), joints, 4 * joints))
    result[:, [joint for joint, _ in axes]] = regressor
    return result


def rotations_by_geometry(
    model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None
) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Joints and components, as of `elastic_axes`, that yield to gravity by their gravity or lateral compliance, and the derivative
    (samples, k, G) of these rotations by the errors of `RobotModel.geometry_columns`, which change gravity's levers.
    """
    q, geometry = joint_batch(model, q), model.geometry
    turning = np.flatnonzero(geometry.gravity_compliance).tolist()
    leaning = np.flatnonzero(geometry.lateral_compliance.any(axis=1)).tolist()
    axes = [*((joint, 2) for joint in turning), *((joint, c) for joint in leaning for c in (0, 1))]
    if not axes:
        return axes, np.zeros((len(q), 0, 0))
    loads, _, _, slopes = _held_rigidly(model, q, payload, axes, sensitivities=True)
    count = len(turning)
    slopes[:, :count] *= -geometry.gravity_compliance[turning][:, None]
    if leaning:
        _to_tilts(model, q, leaning, -loads[:, count:], slopes[:, count:])
    return axes, slopes


def _to_tilts(
    model: RobotModel, q: np.ndarray, leaning: list[int], moments: np.ndarray, slopes: np.ndarray
) -> None:
    """Turn `slopes` (samples, 2 k, G) of gravity's `moments` (samples, 2 k) about the tilt axes of k joints into those of their tilts."""
    tilt, compliance = lateral_axes(model, q)[:, leaning], model.geometry.lateral_compliance[leaning]
    by_load = -np.einsum("ja,sjac,sjad->sjcd", compliance, tilt, tilt)
    paired = (len(q), len(leaning), 2, slopes.shape[2])
    slopes[:] = (by_load @ slopes.reshape(paired)).reshape(slopes.shape)
    if model.bearings == "after":
        # these axes turn with the joint
        turned = np.stack([tilt[..., 1], -tilt[..., 0]], axis=-1)
        across = np.einsum("ja,sjac,sjad->sjcd", compliance, turned, tilt)
        whole = across + across.swapaxes(2, 3)
        change = -np.einsum("sjcd,sjd->sjc", whole, moments.reshape(*paired[:2], 2))
        for k, joint in enumerate(leaning):
            slopes[:, 2 * k : 2 * k + 2, 6 * joint] += change[:, k]


def spring_loads(
    model: RobotModel, q: np.ndarray, payload: np.ndarray | float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Torque (samples, d), N m, of the springs of the undeflected arm against gravity, `regressor` and `coupling` of `Equilibrium`.

    Those of the deflected arm differ by its angles, some 1e-3 of them, and are twice the work.
    """
    loads, _, regressor, coupling = _held_rigidly(model, q, payload, elastic_axes(model), sensitivities=True)
    return -loads, regressor, coupling


def _twists(model: RobotModel) -> list[tuple[int, int]]:
    return [(i, 2) for i, joint in enumerate(model.joints) if joint.kind == "revolute"]


def _held_rigidly(
    model: RobotModel,
    q: np.ndarray,
    payload: np.ndarray | float | None,
    axes: list[tuple[int, int]],
    *,
    sensitivities: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Gravity load (samples, d) N m on springs of unbounded stiffness about the `axes`, their deflection, regressor and coupling."""
    q = joint_batch(model, q)
    masses = payload_batch(model, payload, len(q))
    deflection, _, _, regressor, coupling = _solve(
        model, axes, np.full(len(axes), _RIGID), q, np.zeros((len(q), 1)), masses, sensitivities=sensitivities
    )
    joints, components = (list(column) for column in zip(*axes, strict=True)) if axes else ([], [])
    return _RIGID * deflection[:, joints, components], deflection, regressor, coupling


def static_equilibrium(
    model: RobotModel,
    q: np.ndarray,
    payload: np.ndarray | float | None = None,
    *,
    flank: np.ndarray | None = None,
    elastic: bool = True,
    sensitivities: bool = False,
    parameters: bool = True,
) -> Equilibrium:
    """Rest position of every pose for motors held at `q` (samples, n), to 1e-12 rad.

    `payload` (samples,) or a scalar in kg at the declared payload's centre of mass; None takes the declared mass. `flank` (samples, N)
    overrides the sign of the drive torque that places the arm in the backlash (q_arm = q_M - τ/c - b sign τ, b half the gap); it is that
    of the torque at rest itself, but for an arm that hangs within its gap, where either sign would pull it across: there one of the
    two is taken. Without `elastic` the arm is rigid and only backlash and gravity compliance displace it. Lateral compliance tilts
    axes without a change of the load on springs, some 1e-3 of it; what drives twist less because they harden is that of the undeflected
    arm's load. `sensitivities` are by `parameters` too, or by joint offsets alone. Raises `FlexcalError` where springs cannot carry the
    arm.
    """
    q = joint_batch(model, q)
    masses = payload_batch(model, payload, len(q))
    axes = elastic_axes(model) if elastic else []
    stiffness = np.array([model.springs.stiffness[a] for a in axes])
    if not (np.isfinite(stiffness) & (stiffness > 0)).all():
        raise FlexcalError(
            "E-MODEL-008",
            f"{model.name}: every stiffness must be positive and finite, not {stiffness.min():g} N m/rad.",
        )
    load = gravity_torque(model, q, masses)
    free = transmission_error(model, q) - load * model.geometry.gravity_compliance
    loose = model.drives.backlash > 0
    drives = [k for k, (_, component) in enumerate(axes) if component == 2]
    sprung = [axes[k][0] for k in drives]
    hardening = model.springs.hardening[sprung]
    twist = twist_from_torque(load[:, sprung], stiffness[drives], hardening)
    free[:, sprung] += load[:, sprung] / stiffness[drives] - twist
    rest = np.sign(load) if flank is None else flank

    def solve(rows: np.ndarray | slice) -> list[np.ndarray]:
        """Slack, deflection beside it, torque and derivatives."""
        slack = free[rows] - rest[rows] * model.drives.backlash
        deflection, *derivatives = _solve(
            model,
            axes,
            stiffness,
            q[rows],
            slack,
            masses[rows],
            sensitivities=sensitivities,
            parameters=parameters,
        )
        torque = load[rows].copy()
        torque[:, sprung] = -model.springs.stiffness[sprung, 2] * deflection[:, sprung, 2]
        return [slack, deflection, torque, *derivatives]

    found = solve(slice(None))
    for _ in range(_FLANK_PASSES - 1 if flank is None else 0):
        turned = np.flatnonzero((np.sign(found[2]) != rest)[:, loose].any(axis=1))
        if not len(turned):
            break
        rest[turned] = np.sign(found[2][turned])
        for whole, part in zip(found, solve(turned), strict=True):
            if len(whole):
                whole[turned] = part
    slack, deflection, torque, *derivatives = found
    sign = np.where(loose, rest, np.sign(torque)) if flank is None else flank
    deflection[:, :, 2] += slack
    if model.geometry.lateral_compliance.any():
        slopes = lateral_slopes(model, q, masses)
        deflection[:, :, :2] += np.matmul(model.geometry.lateral_compliance[:, None, :], slopes)[:, :, 0]
    if sensitivities and hardening.any():
        derivatives[0][:, drives] /= tangent_ratio(twist, hardening)[:, :, None]
    has_backlash = np.zeros(len(model.joints))
    has_backlash[list(model.backlash_joints)] = 1.0
    return Equilibrium(
        deflection, torque, sign * has_backlash, np.array(axes, dtype=int).reshape(-1, 2), *derivatives
    )
