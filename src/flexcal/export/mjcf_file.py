"""The MJCF file of a calibrated robot, and the rest position of its tool in MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.actuators import Actuators
from flexcal.export.geometry_fit import render_representable
from flexcal.export.mujoco_spec import GAP, has_gap, mjcf_spec
from flexcal.export.representation_error import (
    BACKLASH,
    GRAVITY_COMPLIANCE,
    HARDENING,
    LATERAL_COMPLIANCE,
    TRANSMISSION,
    ToolMap,
)
from flexcal.export.written_file import ExportedFile, RenderedModel, write_rendered
from flexcal.model.robot import SPRINGS, RobotModel

if TYPE_CHECKING:
    import mujoco

_TIME_STEP = 0.25e-3
_PASSES = 30
_AT_REST = 1e-12
"""Correction of the springs, rad, at which the arm counts as at rest."""


def export_mjcf(model: RobotModel, path: str | Path) -> ExportedFile:
    """Write a robot as MJCF with elastic joints, and measure the error due to the terms that the format lacks; see `render_mjcf`.

    Where it lacks some, the geometry is that with which the points come nearest to those of the robot at rest.

    Parameters
    ----------
    model : RobotModel
        The robot, calibrated or not.
    path : str or Path
        File to write.

    Returns
    -------
    ExportedFile
        The `path`, the error `loss`, and `remarks`; as `str` one paragraph.

    Raises
    ------
    FlexcalError
        Where MuJoCo cannot build the robot, as with links that have no mass, and where the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from flexcal import RobotModel
    >>> from flexcal.export import export_mjcf
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     export_mjcf(model, f"{folder}/ur5.xml").lost
    ()
    """
    return write_rendered(model, path, render_representable(model, render_mjcf))


def render_mjcf(model: RobotModel, actuators: Actuators | None = None) -> RenderedModel:
    """The robot as MJCF: the joints of `mjcf_spec`, all free, with the declared payload; numbers to their last digit.

    With `actuators` it is driven by positions, as the real one, with gains, delay, friction and armature as identified.

    Raises `FlexcalError` where MuJoCo cannot build the robot, as with links that have no mass.
    """
    import mujoco

    spec = mjcf_spec(model, actuators=actuators, backlash=True)
    spec.option.timestep = _TIME_STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    delayed = actuators is None or _delay(spec, model, actuators)
    try:
        compiled = spec.compile()
    except ValueError as problem:
        raise FlexcalError(
            "E-EXPORT-002",
            f"MuJoCo cannot build {model.name} ({' '.join(str(problem).split())}): every moving link needs a mass and an inertia that a "
            f"body can have; complete {model.urdf.name}, or identify dynamics with --estimator sdp.",
        ) from problem
    text = _with_all_digits(spec.to_xml(), compiled)
    remarks = ["Looks and collision bodies stay in the URDF."]
    payload = model.payload
    if payload is not None and payload.mass > 0:
        remarks.append(
            f"The payload of {payload.mass:.3g} kg is part of the link {model.joints[payload.joint].link}."
        )
    if not delayed:
        remarks.append(
            "The delays of the commands are missing: this version of MuJoCo has none; delay the commands, or install a newer one."
        )
    if actuators is not None and actuators.compensates_gravity and model.elastic:
        remarks.append(
            "The controller compensates gravity, which MuJoCo's gravcomp cannot do for a robot with springs: it would hold the arm behind "
            "them too; apply the torques (qfrc_applied) yourself."
        )
    if actuators is None and model.drives.coulomb[np.isfinite(model.drives.coulomb)].any():
        remarks.append("Coulomb friction of the drives is MuJoCo's frictionloss, which holds an arm at rest.")
    springs = [
        f"{joint.name}.{SPRINGS[component]}" for joint in model.elastic for component in joint.components
    ]
    about = (
        "Joints: NAME is the motor's, referred to the joint; the actuator of that name "
        + (
            "is its torque, N m."
            if actuators is None
            else "takes its commanded position, rad or m"
            + (", and NAME.velocity its commanded velocity." if actuators.follows_velocity else ".")
        ),
    )
    if actuators is not None and delayed and actuators.delay.any():
        about += (
            "The commands before the first step count as 0 where mj_initCtrlHistory does not say otherwise.",
        )
    gaps = [joint.name for i, joint in enumerate(model.joints) if has_gap(model, i, actuators)]
    if gaps:
        about += (f"Gaps: {', '.join(name + GAP for name in gaps)}; the arm moves freely within.",)
    lacking = () if np.count_nonzero(model.drives.backlash) == len(gaps) else (BACKLASH,)
    if springs:
        about += (
            f"Springs: {', '.join(springs)}; q of a drive spring is what the arm turns beyond its motor.",
        )
    return RenderedModel(
        text,
        mjcf_tool(model, text),
        (*lacking, GRAVITY_COMPLIANCE, HARDENING, LATERAL_COMPLIANCE, TRANSMISSION),
        "<!--",
        about=about,
        remarks=tuple(remarks),
    )


def mjcf_tool(model: RobotModel, text: str) -> ToolMap:
    """Position of the first point of `model` at rest in MuJoCo, from the MJCF `text` with the motors held: Newton on the springs."""

    def positions(q: np.ndarray) -> np.ndarray:
        import mujoco

        read = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(read)
        motors = [read.joint(name).qposadr[0] for name in model.joint_names]
        others = [i for i in range(read.njnt) if read.joint(i).name not in model.joint_names]
        gaps = [i for i in others if read.joint(i).name.endswith(GAP)]
        free = [read.jnt_dofadr[i] for i in gaps]
        springs = [read.jnt_dofadr[i] for i in others if i not in gaps]
        stiffness = np.array([_linear(read.jnt_stiffness[read.dof_jntid[i]]) for i in springs])
        result = np.zeros((len(q), 3))
        for k, motor_positions in enumerate(q):
            data.qpos[:] = 0.0
            data.qpos[motors] = motor_positions
            for _ in range(_PASSES):
                mujoco.mj_forward(read, data)
                side = np.where(data.qfrc_bias[free] < 0, 1, 0)
                moved = read.jnt_range[gaps, side] != data.qpos[free]
                data.qpos[free] = read.jnt_range[gaps, side]
                if not springs and not moved.any():
                    break
                step = (data.qfrc_passive - data.qfrc_bias)[springs] / stiffness
                data.qpos[springs] += step
                if not moved.any() and np.abs(step).max(initial=0.0) < _AT_REST:
                    break
            mujoco.mj_kinematics(read, data)
            result[k] = data.site(model.point().name).xpos
        return result

    return positions


def _delay(spec: mujoco.MjSpec, model: RobotModel, actuators: Actuators) -> bool:
    """Delay the commands, interpolated, as they were identified; False where MuJoCo cannot."""
    for i, joint in enumerate(model.joint_names):
        for name in (joint, f"{joint}.velocity") if actuators.follows_velocity else (joint,):
            drive = spec.actuator(name)
            if not hasattr(drive, "delay"):
                return False
            delay = float(actuators.delay[i])
            if delay > 0:
                drive.delay, drive.nsample, drive.interp = delay, int(np.ceil(delay / _TIME_STEP)) + 2, 1
    return True


def _with_all_digits(xml: str, compiled: mujoco.MjModel) -> str:
    """MuJoCo's XML, which it rounds to six digits, with the numbers of the compiled robot."""
    root = ET.fromstring(xml)
    option = root.find("option")
    assert option is not None
    option.set("gravity", _digits(compiled.opt.gravity))
    for element in root.iter("body"):
        body = compiled.body(element.get("name"))
        element.set("pos", _digits(body.pos))
        element.set("quat", _digits(body.quat))
        inertial = element.find("inertial")
        if inertial is not None:
            inertial.set("pos", _digits(body.ipos))
            inertial.set("quat", _digits(body.iquat))
            inertial.set("mass", _digits(body.mass))
            inertial.set("diaginertia", _digits(body.inertia))
        for own in element.findall("joint"):
            joint = compiled.joint(own.get("name"))
            dof = joint.dofadr[0]
            own.set("axis", _digits(joint.axis))
            exact = {
                "range": joint.range,
                "stiffness": _linear(joint.stiffness),
                "damping": _linear(compiled.dof_damping[dof]),
                "armature": compiled.dof_armature[dof],
                "frictionloss": compiled.dof_frictionloss[dof],
            }
            for key in exact.keys() & own.keys():
                own.set(key, _digits(exact[key]))
        for own in element.findall("site"):
            site = compiled.site(own.get("name"))
            own.set("pos", _digits(site.pos))
            own.set("quat", _digits(site.quat))
    for element in root.iter("general"):
        drive = compiled.actuator(element.get("name"))
        for key, values in (("gainprm", drive.gainprm), ("biasprm", drive.biasprm)):
            if element.get(key) is not None:
                element.set(key, _digits(values[: len(element.get(key, "").split())]))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _linear(coefficient: np.ndarray | float) -> float:
    """The linear coefficient of a spring or damper: a number up to MuJoCo 3, the first of a polynomial from 4 on."""
    return float(np.ravel(coefficient)[0])


def _digits(values: np.ndarray | float) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))
