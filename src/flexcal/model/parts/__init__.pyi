from .inertia import LINK_PARAMETERS, Inertia, parallel_axis
from .joint import ElasticJoint, Joint, normals_to
from .point import ForceSensor, Payload, Point
from .pseudo_inertia_matrix import PSEUDO_INERTIA, is_physically_consistent, pseudo_inertia
from .rotations import (
    axis_rotation,
    axis_rotations,
    inverse_right_jacobians,
    left_jacobian,
    rotation_rpy,
    rotation_vector,
    rotation_wxyz,
    rpy_rotation,
    skew_matrix,
    vector_rotation,
    wxyz_rotation,
)
from .tree import Bearings, bearing_frame, branching_joints, kinematic_tree, path_to

__all__ = [
    "LINK_PARAMETERS",
    "PSEUDO_INERTIA",
    "Bearings",
    "ElasticJoint",
    "ForceSensor",
    "Inertia",
    "Joint",
    "Payload",
    "Point",
    "axis_rotation",
    "axis_rotations",
    "bearing_frame",
    "branching_joints",
    "inverse_right_jacobians",
    "is_physically_consistent",
    "kinematic_tree",
    "left_jacobian",
    "normals_to",
    "parallel_axis",
    "path_to",
    "pseudo_inertia",
    "rotation_rpy",
    "rotation_vector",
    "rotation_wxyz",
    "rpy_rotation",
    "skew_matrix",
    "vector_rotation",
    "wxyz_rotation",
]
