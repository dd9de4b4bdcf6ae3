from .compensation import Compensation, compensate, compensate_robot
from .export import (
    ExportedRobot,
    export_robot,
    export_stored_robot,
    identified_robot,
    poses_where_it_holds,
    undetermined_zeros,
)
from .filtered_program import FilteredProgram
from .prediction import Prediction, predict, predict_robot
from .program_files import read_program, written_files
from .program_filter import filter_program, filter_program_file
from .torque_model import read_torque_model
from .xacro_export import ExportedXacro, export_xacro

__all__ = [
    "Compensation",
    "ExportedRobot",
    "ExportedXacro",
    "FilteredProgram",
    "Prediction",
    "compensate",
    "compensate_robot",
    "export_robot",
    "export_stored_robot",
    "export_xacro",
    "filter_program",
    "filter_program_file",
    "identified_robot",
    "poses_where_it_holds",
    "predict",
    "predict_robot",
    "read_program",
    "read_torque_model",
    "undetermined_zeros",
    "written_files",
]
