from .bearing_axes import bearing_remarks, bearings_block
from .job import identify_robot_stiffness
from .remarks import further_joints

__all__ = [
    "bearing_remarks",
    "bearings_block",
    "further_joints",
    "identify_robot_stiffness",
]
