from .compensation import compensate_robot
from .export import (
    ExportedRobot,
    export_dh,
    export_json,
    export_kinematics,
    export_mjcf,
    export_offsets,
    export_sdf,
    export_urdf,
)
from .prediction import predict_robot

__all__ = [
    "ExportedRobot",
    "compensate_robot",
    "export_dh",
    "export_json",
    "export_kinematics",
    "export_mjcf",
    "export_offsets",
    "export_sdf",
    "export_urdf",
    "predict_robot",
]
