from .compensation import compensate_robot
from .export import ExportedRobot, export_dh, export_offsets, export_robot
from .prediction import predict_robot

__all__ = [
    "ExportedRobot",
    "compensate_robot",
    "export_dh",
    "export_offsets",
    "export_robot",
    "predict_robot",
]
