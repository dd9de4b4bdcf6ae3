from .compensation import Compensation, compensate, compensate_robot
from .export import ExportedRobot, export_robot, export_stored_robot
from .prediction import Prediction, predict, predict_robot
from .program_files import with_companions
from .program_filter import FilteredProgram, filter_program, filter_program_file

__all__ = [
    "Compensation",
    "ExportedRobot",
    "FilteredProgram",
    "Prediction",
    "compensate",
    "compensate_robot",
    "export_robot",
    "export_stored_robot",
    "filter_program",
    "filter_program_file",
    "predict",
    "predict_robot",
    "with_companions",
]
