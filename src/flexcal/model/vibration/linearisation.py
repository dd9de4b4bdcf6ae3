"""Elastic robot linearised about a rest position: M, D, K of rotors and arm, and their exact derivatives (Eqs. 5, 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.robot import MASS_AND_COM, SPRINGS, ArmSensor, RobotModel
from flexcal.model.statics import (
    Equilibrium,
    elastic_axes,
    static_equilibrium,
    tangent_ratio,
    twist_from_torque,
)
from flexcal.model.vibration.elastic_arm import ElasticArm, moved_inertia
from flexcal.model.vibration.sensor_outputs import SensorOutputs, assemble_sensor_outputs


@dataclass(frozen=True, eq=False)
class Linearisation:
    """M q̈ + D q̇ + K q = B τ for E rotors followed by d elastic coordinates, at one rest position.

    Joints that are not `driven` are held: rigidly, or by their drive spring where the motor is braked.

    `mass`, `damping`, `stiffness` are (E + d, E + d). `derivatives` maps a parameter name to (∂M, ∂D, ∂K), the motion of the rest
    position with the parameter included. `sensed` is what sensors on the arm measure, where there are any.
    """

    joints: tuple[str, ...]
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    derivatives: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]
    sensed: SensorOutputs | None = None

    @property
    def inputs(self) -> int:
        """Number of rotors E, which are the inputs and outputs of the transfer matrix."""
        return len(self.joints)


def linearise(
    robot: RobotModel,
    q: np.ndarray,
    payload: float | None = None,
    *,
    derivatives: Sequence[str] = (),
    sensors: Sequence[ArmSensor] = (),
    like: ElasticArm | None = None,
) -> Linearisation:
    """Linearise about the rest position of motors held at `q` (n,) with `payload` kg (None: the declared mass), with outputs of `sensors`.

    `derivatives` names parameters: `<joint>.<spring>.stiffness|damping`, `<joint>.rotor_inertia|viscous|held_inertia`,
    `<link>.mass|com_x…`, `payload.mass|com_x…`. Setting a mass carries the inertia along as `RobotModel.with_values` does. `like` is the
    arm of a robot that may differ in its values alone: from it this one's is made faster. Raises
    `FlexcalError` where a rotor inertia is not declared, or a name is none of these.
    """
    if not robot.elastic:
        raise FlexcalError(
            "E-MODEL-013",
            f"{robot.path} declares no elastic joint; add `elastic:` with starting values of the stiffnesses.",
        )
    count, axes = len(robot.driven), elastic_axes(robot)
    size = count + len(axes)
    arm = ElasticArm(robot, payload) if like is None else like.with_inertials(robot, payload)
    rest = static_equilibrium(robot, q, arm.payload, sensitivities=bool(derivatives))
    at = arm.configuration(np.asarray(q, dtype=float), rest.deflection[0])
    mass, damping, stiffness = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    mass[count:, count:] = arm.mass_matrix(at)
    stiffness[count:, count:] = arm.gravity_stiffness(at)
    for r, joint in enumerate(robot.driven):
        if not robot.drives.rotor_inertia[joint.index] > 0:
            raise FlexcalError(
                "E-MODEL-014",
                f"{robot.path} gives no rotor inertia for the elastic joint {joint.name}; add `drives: rotor_inertia:`.",
            )
        mass[r, r] = robot.drives.rotor_inertia[joint.index]
        damping[r, r] = np.nan_to_num(robot.drives.viscous[joint.index])
    for k, (joint, component) in enumerate(axes):
        if component == 2 and joint in robot.springs.braked:
            mass[count + k, count + k] += robot.drives.held_inertia[joint]
    springs = _springs(robot, axes, rest)
    for pattern, k, c in springs.values():
        stiffness += k * pattern
        damping += c * pattern
    result: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
    motions: dict[str, np.ndarray] = {}
    if derivatives:
        motions = {name: _rest_motion(robot, arm, rest, axes, name) for name in derivatives}
        result = _derivatives(robot, arm, at, motions, axes, springs)
    sensed = assemble_sensor_outputs(arm, at, sensors, count, motions) if sensors else None
    return Linearisation(tuple(e.name for e in robot.driven), mass, damping, stiffness, result, sensed)


def _springs(
    robot: RobotModel, axes: list[tuple[int, int]], rest: Equilibrium
) -> dict[tuple[int, int], tuple[np.ndarray, float, float]]:
    """Pattern (E + d, E + d), stiffness and damping of each spring, by its axis: a drive spring couples rotor and twist.

    A braked rotor does not move, so its spring holds the twist against the ground. The pattern of a drive that hardens is larger by its
    tangent stiffness at rest.
    """
    steeper = tangent_ratio(_twists(robot, rest), robot.springs.hardening)
    count = len(robot.driven)
    rotor = {e.index: r for r, e in enumerate(robot.driven)}
    result = {}
    for k, (joint, component) in enumerate(axes):
        stretch = np.zeros(count + len(axes))
        stretch[count + k] = 1.0
        if component == 2 and joint in rotor:
            stretch[rotor[joint]] = -1.0
        pattern = np.outer(stretch, stretch) * (steeper[joint] if component == 2 else 1.0)
        result[joint, component] = (
            pattern,
            robot.springs.stiffness[joint, component],
            robot.springs.damping[joint, component],
        )
    return result


def _derivatives(
    robot: RobotModel,
    arm: ElasticArm,
    at: np.ndarray,
    motions: dict[str, np.ndarray],
    axes: list[tuple[int, int]],
    springs: dict[tuple[int, int], tuple[np.ndarray, float, float]],
) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    count, d = len(robot.driven), len(axes)
    size = count + d
    by_motion_mass = arm.mass_matrix_derivatives(at)
    by_motion_stiffness = arm.gravity_stiffness_derivatives(at)
    zero = np.zeros((size, size))

    def widened(block: np.ndarray) -> np.ndarray:
        full = np.zeros((size, size))
        full[count:, count:] = block
        return full

    def moved(motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return by_motion_mass @ motion, by_motion_stiffness @ motion

    result = {}
    for name, motion in motions.items():
        owner, _, key = name.rpartition(".")
        joint_name, _, spring = owner.rpartition(".")
        if key in ("stiffness", "damping") and spring in SPRINGS:
            axis = (robot.joint_index(joint_name), SPRINGS.index(spring))
            pattern = springs[axis][0]
            if key == "damping":
                result[name] = (zero, pattern, zero)
                continue
            mass, stiffness = moved(motion)
            result[name] = (widened(mass), zero, pattern + widened(stiffness))
        elif key == "held_inertia":
            k = count + axes.index((robot.joint_index(owner), 2))
            unit = np.zeros((size, size))
            unit[k, k] = 1.0
            result[name] = (unit, zero, zero)
        elif key in ("rotor_inertia", "viscous"):
            r = [e.name for e in robot.driven].index(owner)
            unit = np.zeros((size, size))
            unit[r, r] = 1.0
            result[name] = (unit, zero, zero) if key == "rotor_inertia" else (zero, unit, zero)
        elif key in MASS_AND_COM:
            mass, stiffness = _by_inertia(robot, arm, at, owner, key)
            more_mass, more_stiffness = moved(motion)
            result[name] = (widened(mass + more_mass), zero, widened(stiffness + more_stiffness))
        else:
            raise FlexcalError(
                "E-MODEL-015", f"the linearised robot has no derivative with respect to '{name}'."
            )
    return result


def _rest_motion(
    robot: RobotModel, arm: ElasticArm, rest: Equilibrium, axes: list[tuple[int, int]], name: str
) -> np.ndarray:
    """Derivative (d,) of the elastic rest position with respect to a parameter."""
    owner, _, key = name.rpartition(".")
    joint_name, _, spring = owner.rpartition(".")
    if key == "stiffness" and spring in SPRINGS:
        axis = (robot.joint_index(joint_name), SPRINGS.index(spring))
        return -rest.compliance[0][:, axes.index(axis)] * _stretch(robot, rest, axis)
    if key in MASS_AND_COM:
        return -rest.compliance[0] @ _load_by_inertia(robot, arm, rest, owner, key)
    return np.zeros(len(axes))


def _twists(robot: RobotModel, rest: Equilibrium) -> np.ndarray:
    """Twist (n,) of the drive springs at rest, rad; 0 for rigid joints."""
    twist, sprung = np.zeros(robot.n), [e.index for e in robot.elastic]
    twist[sprung] = -twist_from_torque(
        rest.torque[0, sprung], robot.springs.stiffness[sprung, 2], robot.springs.hardening[sprung]
    )
    return twist


def _stretch(robot: RobotModel, rest: Equilibrium, axis: tuple[int, int]) -> float:
    joint, component = axis
    if component != 2:
        return float(rest.deflection[0, joint, component])
    return float(-rest.torque[0, joint] / robot.springs.stiffness[joint, 2])


def _by_inertia(
    robot: RobotModel, arm: ElasticArm, at: np.ndarray, owner: str, key: str
) -> tuple[np.ndarray, np.ndarray]:
    """∂M and ∂K (d, d) with respect to a mass or centre of mass; both are at most quadratic in it, so central differences are exact."""
    payload = robot.payload if owner == "payload" else None
    i = [joint.link for joint in robot.joints].index(owner) if payload is None else payload.joint
    link, carried, results = robot.inertias[i], None, []
    step = 0.05 * ((link if payload is None else payload).mass if key == "mass" else 1.0)
    step = step if step > 0 else 1.0
    shift = np.zeros(3) if key == "mass" else step * np.eye(3)["xyz".index(key[-1])]
    for sign in (1, -1):
        changed = link
        if payload is not None:
            mass = max(arm.payload, step) + sign * step if key == "mass" else arm.payload  # linear in it
            carried = replace(payload, com=payload.com + sign * shift).carried(mass)
        else:
            mass = link.mass + sign * step if key == "mass" else link.mass
            changed = moved_inertia(link, mass, link.com + sign * shift)
        arm.set_inertia(i, changed, carried)
        results.append((arm.mass_matrix(at), arm.gravity_stiffness(at)))
    arm.set_inertia(i, link)
    (m_plus, k_plus), (m_minus, k_minus) = results
    return (m_plus - m_minus) / (2 * step), (k_plus - k_minus) / (2 * step)


def _load_by_inertia(
    robot: RobotModel, arm: ElasticArm, rest: Equilibrium, owner: str, key: str
) -> np.ndarray:
    """∂(gravity load)/∂(mass or centre of mass) of each elastic coordinate (d,)."""
    if owner == "payload":
        payload = robot.payload
        assert payload is not None
        block = rest.regressor[0][:, 4 * payload.joint : 4 * payload.joint + 4]
        if key == "mass":
            return block[:, 0] + block[:, 1:] @ payload.com_in_link
        return arm.payload * (block[:, 1:] @ payload.rotation[:, "xyz".index(key[-1])])
    i = [joint.link for joint in robot.joints].index(owner)
    block = rest.regressor[0][:, 4 * i : 4 * i + 4]
    if key == "mass":
        return block[:, 0] + block[:, 1:] @ robot.links.com[i]
    return robot.links.mass[i] * block[:, 1 + "xyz".index(key[-1])]
