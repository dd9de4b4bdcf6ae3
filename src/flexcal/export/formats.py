"""File formats for the export of a calibrated robot; their modules are imported when needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexcal.export.written_file import RenderedModel
    from flexcal.model.robot import RobotModel


@dataclass(frozen=True)
class Format:
    """Export format: `name` on the command line, one-line description, and the name of an `example` file."""

    name: str
    summary: str
    example: str


@dataclass(frozen=True)
class PlainFormat(Format):
    """Format without options of its own: the calibrated robot and the nominal one determine the file.

    `details` is the help page; `following` says what to do with the file `{out}`.
    """

    render: Callable[[RobotModel, RobotModel], RenderedModel]
    details: str
    following: str


def _urdf(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    from flexcal.export.urdf import render_urdf

    return render_urdf(model)


def _mjcf(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    from flexcal.export.mjcf_file import render_mjcf

    return render_mjcf(model)


def _sdf(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    from flexcal.export.sdf import render_sdf

    return render_sdf(model, nominal)


def _kinematics(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    from flexcal.export.universal_robots import render_kinematics

    return render_kinematics(model, nominal)


def _json(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    from flexcal.export.json_model import render_json

    return render_json(model, nominal)


FORMATS: tuple[Format, ...] = (
    PlainFormat(
        "urdf",
        "the calibrated robot as URDF, and the error in millimetres of what URDF cannot represent",
        "calibrated.urdf",
        _urdf,
        """Write the calibrated robot as URDF: calibrated joint origins and tool, links with identified inertials.

A URDF cannot represent deflection, backlash and transmission error; the resulting error is printed in millimetres. Rotor inertia
and friction stay in estimates.yaml.""",
        "load {out} wherever the nominal URDF was loaded",
    ),
    PlainFormat(
        "mjcf",
        "with springs, dampers and rotors as joints, for MuJoCo",
        "calibrated.xml",
        _mjcf,
        """Write the calibrated robot as MJCF for MuJoCo, with its springs, dampers and rotors as joints and its payload in the last link.

It deflects under gravity as the calibrated robot does, and has its backlash. After 'identify actuators' it takes commanded positions, with
gains, delay, friction and armature as identified; else torques. MJCF cannot represent gravity compliance and transmission error; the
resulting error is printed in millimetres.""",
        "load {out} in MuJoCo, or look at it with 'python -m mujoco.viewer --mjcf={out}'",
    ),
    PlainFormat(
        "sdf",
        "as SDFormat, for Gazebo",
        "calibrated.sdf",
        _sdf,
        """Write the calibrated robot as SDFormat 1.7 for Gazebo: geometry, inertials and friction, without visuals and collision bodies.

SDFormat cannot represent deflection, backlash and transmission error; the resulting error is printed in millimetres.""",
        "include {out} in a Gazebo world",
    ),
    Format("dh", "the standard Denavit-Hartenberg table, nominal beside calibrated", "dh.csv"),
    Format("mdh", "the modified Denavit-Hartenberg table, nominal beside calibrated", "mdh.csv"),
    Format("offsets", "the best joint offsets, for controllers that accept nothing else", "offsets.csv"),
    PlainFormat(
        "kinematics",
        "the kinematics YAML of Universal Robots' ROS description",
        "kinematics.yaml",
        _kinematics,
        """Write the placements of the six joints as the `kinematics` YAML of Universal Robots' ROS description.

Its frames are those of that description, whatever those of the URDF are, for robots of that manufacturer. It cannot hold the tool,
which is printed.""",
        "give {out} to the description or driver as kinematics_params_file",
    ),
    Format("isaac", "identified actuators, for Isaac Lab and PACE", "actuators.json"),
    Format("runtime", "for the C++ runtime, which compensates in the control loop", "runtime.json"),
    PlainFormat(
        "json",
        "the whole calibrated model, for programs of your own",
        "calibrated.json",
        _json,
        """Write the complete calibrated model as one JSON document, for programs of your own.

Joints with placements, springs, backlash and drives, points, payload, stations, and every parameter with its standard deviation.""",
        "read {out} in your own program; docs/file-formats.md describes its content",
    ),
)
"""Formats in the order of the help page."""


def render(name: str, model: RobotModel, nominal: RobotModel) -> RenderedModel:
    """A calibrated robot and its nominal one as text of the plain format `name`."""
    (format,) = (each for each in FORMATS if each.name == name and isinstance(each, PlainFormat))
    return format.render(model, nominal)
