from .inertia import LINK_PARAMETERS, Inertia, parallel_axis
from .joint import ElasticJoint, Joint, normals_to
from .point import ForceSensor, Payload, Point
from .pseudo_inertia_matrix import PSEUDO_INERTIA, is_physically_consistent, pseudo_inertia
from .relations import LOOP, Loop, LoopEnd, Relations, carried, common_joint, joints_that_move
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
    "LOOP",
    "PSEUDO_INERTIA",
    "Bearings",
    "ElasticJoint",
    "ForceSensor",
    "Inertia",
    "Joint",
    "Loop",
    "LoopEnd",
    "Payload",
    "Point",
    "Relations",
    "axis_rotation",
    "axis_rotations",
    "bearing_frame",
    "branching_joints",
    "carried",
    "common_joint",
    "inverse_right_jacobians",
    "is_physically_consistent",
    "joints_that_move",
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
