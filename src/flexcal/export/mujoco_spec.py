"""Conversion of `RobotModel` to MuJoCo: rotors, drive springs and bearings as joints of one kinematic tree.

A joint with springs is up to four hinges on the link's body, outermost first: the motor about the joint axis with the rotor's
`armature`, the twist of the drive spring about the same axis, the tilts about the bearing's y and x; bearings that are fixed to the
parent link (`bearings: before`) come first, tilts about y and x, motor, twist. So the rotor carries the
kinetic energy of its own spin only, the spring is an ordinary joint spring (no tendon between two trees, whose damping
`implicitfast` would get wrong) and the geometry is the chain of `flexcal.model`: misalignments and offset lie in the body's
placement, the length errors in the placement of the next body.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.actuators import Actuators
from flexcal.model.kinematics import bearing_placement, link_placement, point_placement
from flexcal.model.parts import rotation_wxyz
from flexcal.model.robot import SPRINGS, RobotModel, carried_inertias
from flexcal.mujoco_library import log_mujoco_warnings

if TYPE_CHECKING:
    import mujoco

GAP = ".backlash"
"""Ending of the name of a joint that is the gap of a drive."""
_GAP_INERTIA = 0.01
"""Inertia between a gap and a spring, over that of the rotor."""
_SOLREF, _GAP_SOLREF = (0.0005, 1.0), (0.001, 1.0)
_SOLIMP = (0.99, 0.99, 0.001, 0.5, 2.0)
"""Softness of dry friction and of the ends of a gap, much less than MuJoCo's own, with which a joint creeps visibly; MuJoCo takes two time
steps for the first number at least, and from an end of four the arm does not bounce."""


def mjcf_spec(
    model: RobotModel,
    *,
    q: np.ndarray | None = None,
    free: Collection[int] | None = None,
    payload: float | None = None,
    actuators: Actuators | None = None,
    backlash: bool = False,
) -> mujoco.MjSpec:
    """Robot as an `MjSpec`, with all identified values.

    `q` (n,) rad or m: where the joints that are not in `free` are locked (default: all joints are free); `payload` kg at the declared
    payload's centre of mass (default: the declared mass). MuJoCo joints are named `<joint>` (motor side), `<joint>.drive` (twist
    of the arm beyond the motor), `<joint>.bearing_y`, `<joint>.bearing_x`; sites have the points' names. Coulomb friction becomes
    `frictionloss`, which is not a tanh.

    With `backlash` the gap of a drive is a joint `<joint>.backlash` that moves freely within it, of drives with a known rotor, which has
    to move by itself. With `actuators` the joints have their armature and friction, and the MuJoCo actuator `<joint>` takes positions
    (and `<joint>.velocity` velocities, where the damping follows them), not torques; their delay is not in it. Bodies of rigid
    robots have `gravcomp` where the controller compensates gravity; behind springs it would hold the arm too.

    Raises `FlexcalError` where a joint is locked without `q`, or a payload is given but none declared.
    """
    import mujoco

    model.require_motors("MJCF")
    log_mujoco_warnings()
    motors = set(range(model.n)) if free is None else set(free)
    if len(motors) < model.n and q is None:
        raise FlexcalError(
            "E-EXPORT-003", "joints are to be locked but no pose is given; pass q, one value per joint."
        )
    at = np.zeros(model.n) if q is None else np.asarray(q, dtype=float)
    spec = mujoco.MjSpec()
    spec.modelname = model.name
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    spec.option.gravity = model.gravity
    bodies: list[mujoco.MjsBody] = []
    for i, inertia in enumerate(carried_inertias(model, payload)):
        joint = model.joints[i]
        parent = spec.worldbody if joint.parent < 0 else bodies[joint.parent]
        position, rotation = link_placement(model, i, 0.0 if i in motors else at[i])
        body = parent.add_body(name=joint.link, pos=position, quat=rotation_wxyz(rotation))
        body.mass = inertia.mass
        body.ipos = inertia.com
        body.fullinertia = inertia.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        body.explicitinertial = True
        if actuators is not None and actuators.compensates_gravity and not model.elastic:
            body.gravcomp = 1.0
        _add_joints(spec, body, model, i, None if i in motors else at[i], actuators, backlash)
        bodies.append(body)
    for name in model.points:
        joint, position, rotation = point_placement(model, name)
        bodies[joint].add_site(name=name, pos=position, quat=rotation_wxyz(rotation))
    return spec


def _add_joints(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    model: RobotModel,
    i: int,
    locked: float | None,
    actuators: Actuators | None,
    backlash: bool,
) -> None:
    """Motor, gap and springs of a joint, outermost first; the motor is left out where it is locked, at that angle (rad or m)."""
    import mujoco

    spring = next((e for e in model.elastic if e.index == i), None)
    for component in spring.components if spring else (2,):
        if component == 2 and locked is None:
            motor = _add_motor(body, model, i)
            if actuators is None:
                _drive_by_torque(spec, motor, model, i)
            else:
                _drive_by_position(spec, motor, model, i, actuators)
            if backlash and has_gap(model, i, actuators):
                _add_gap(body, motor, model, i, _GAP_INERTIA * motor.armature if spring else 0.0)
        if spring:
            name = f"{spring.name}.{SPRINGS[component]}"
            axis = bearing_placement(model, spring, locked or 0.0)[:, component]
            joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
            joint.stiffness = _linear(joint.stiffness, float(spring.stiffness[component]))
            joint.damping = _linear(joint.damping, float(spring.damping[component]))


def _add_motor(body: mujoco.MjsBody, model: RobotModel, i: int) -> mujoco.MjsJoint:
    import mujoco

    joint = model.joints[i]
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.kind == "prismatic" else mujoco.mjtJoint.mjJNT_HINGE
    motor = body.add_joint(name=joint.name, type=kind, axis=joint.axis)
    if np.isfinite([joint.lower, joint.upper]).all():
        motor.range = [joint.lower, joint.upper]
    return motor


def has_gap(model: RobotModel, i: int, actuators: Actuators | None) -> bool:
    """Whether a joint has a backlash, and a rotor that can move within it."""
    rotor = model.drives.rotor_inertia[i] if actuators is None else actuators.armature[i]
    return bool(model.drives.backlash[i] > 0 and _known(rotor) > 0)


def _add_gap(body: mujoco.MjsBody, motor: mujoco.MjsJoint, model: RobotModel, i: int, inertia: float) -> None:
    """The gap, with the inertia of what moves between it and a spring, without which MuJoCo cannot tell the two apart."""
    half = float(model.drives.backlash[i])
    gap = body.add_joint(name=f"{motor.name}{GAP}", type=motor.type, axis=motor.axis)
    gap.range = [-half, half]
    gap.armature = inertia
    gap.solref_limit[:], gap.solimp_limit[:] = _GAP_SOLREF, _SOLIMP


def _drive_by_torque(spec: mujoco.MjSpec, motor: mujoco.MjsJoint, model: RobotModel, i: int) -> None:
    import mujoco

    motor.armature = _known(model.drives.rotor_inertia[i])
    motor.damping = _linear(motor.damping, _known(model.drives.viscous[i]))
    motor.frictionloss = _known(model.drives.coulomb[i])
    drive = spec.add_actuator(name=motor.name, target=motor.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    effort = effort_limit(model, i)
    if effort is not None:
        drive.ctrlrange = [-effort, effort]


def _drive_by_position(
    spec: mujoco.MjSpec, motor: mujoco.MjsJoint, model: RobotModel, i: int, actuators: Actuators
) -> None:
    """K (u − q) − D q̇ by an affine bias; D u̇ by a second actuator; the limit of the torque is the joint's, as it is of their sum."""
    import mujoco

    motor.armature = float(actuators.armature[i])
    motor.damping = _linear(motor.damping, float(actuators.viscous[i]))
    motor.frictionloss = float(actuators.coulomb[i])
    motor.solref_friction[:], motor.solimp_friction[:] = _SOLREF, _SOLIMP
    effort = effort_limit(model, i)
    if effort is not None:
        motor.actfrcrange = [-effort, effort]
    drive = spec.add_actuator(name=motor.name, target=motor.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    drive.gaintype, drive.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    drive.gainprm[0] = actuators.stiffness[i]
    drive.biasprm[:3] = [0.0, -actuators.stiffness[i], -actuators.damping[i]]
    if actuators.follows_velocity:
        drive = spec.add_actuator(
            name=f"{motor.name}.velocity", target=motor.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        drive.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        drive.gainprm[0] = actuators.damping[i]


def effort_limit(model: RobotModel, i: int) -> float | None:
    """Largest torque of a joint's drive, N m (N), where the URDF says one."""
    effort = model.joints[i].effort
    return float(effort) if np.isfinite(effort) and effort > 0 else None


def _linear(default: float | np.ndarray, value: float) -> float | np.ndarray:
    """`value` in the form of a joint's coefficient: a number up to MuJoCo 3, a polynomial with the linear one first from 4 on."""
    if np.ndim(default) == 0:
        return value
    coefficients = np.zeros(np.shape(default))
    coefficients.flat[0] = value
    return coefficients


def _known(value: float) -> float:
    return float(value) if np.isfinite(value) else 0.0
