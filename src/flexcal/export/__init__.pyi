from .actuators import COMPENSATED, OF_ERROR, Actuators, actuator_name, actuator_unit
from .dh_table import Convention, render_dh
from .formats import FORMATS, PlainFormat, render
from .geometry_fit import render_representable, representable_robot
from .isaac import TIME_STEP, render_isaac
from .mjcf_file import export_mjcf, render_mjcf
from .motor_calibration import (
    TICKS,
    JointMotor,
    MotorCalibration,
    Readings,
    corrected_file,
    joint_motors,
    read_motor_calibrations,
)
from .moveit_limits import shifted_limits
from .mujoco_spec import effort_limit, mjcf_spec
from .offset_fit import undetermined_offsets
from .offset_table import render_offsets
from .representation_error import AT_REST, SAMPLES, DrawPoses, ExportErrors, drawing_limits, random_poses
from .runtime_file import render_runtime
from .urdf import export_urdf
from .written_file import ExportedFile, RenderedModel, measure_export_error, write_rendered
from .xacro_expansion import XacroSource
from .xacro_robot import XacroExport, Zeros, render_xacro

__all__ = [
    "AT_REST",
    "COMPENSATED",
    "FORMATS",
    "OF_ERROR",
    "SAMPLES",
    "TICKS",
    "TIME_STEP",
    "Actuators",
    "Convention",
    "DrawPoses",
    "ExportErrors",
    "ExportedFile",
    "JointMotor",
    "MotorCalibration",
    "PlainFormat",
    "Readings",
    "RenderedModel",
    "XacroExport",
    "XacroSource",
    "Zeros",
    "actuator_name",
    "actuator_unit",
    "corrected_file",
    "drawing_limits",
    "effort_limit",
    "export_mjcf",
    "export_urdf",
    "joint_motors",
    "measure_export_error",
    "mjcf_spec",
    "random_poses",
    "read_motor_calibrations",
    "render",
    "render_dh",
    "render_isaac",
    "render_mjcf",
    "render_offsets",
    "render_representable",
    "render_runtime",
    "render_xacro",
    "representable_robot",
    "shifted_limits",
    "undetermined_offsets",
    "write_rendered",
]
