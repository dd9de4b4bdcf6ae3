from .compensation import Compensation, compensate, compensate_robot
from .export import ExportedRobot, export_robot, export_stored_robot
from .prediction import Prediction, predict, predict_robot

__all__ = [
    "Compensation",
    "ExportedRobot",
    "Prediction",
    "compensate",
    "compensate_robot",
    "export_robot",
    "export_stored_robot",
    "predict",
    "predict_robot",
]
