from .bearing_axes import bearing_remarks, bearings_block
from .identification import identify_stiffness
from .job import identify_robot_stiffness
from .remarks import further_joints
from .result import StiffnessIdentification

__all__ = [
    "StiffnessIdentification",
    "bearing_remarks",
    "bearings_block",
    "further_joints",
    "identify_robot_stiffness",
    "identify_stiffness",
]
