from .following_joints import JointMotion, joint_motion, joint_positions, loop_gap
from .forward import PointKinematics, joint_batch, motor_motion, point_kinematics
from .inverse import damped_step, reach_points
from .joint_space import joint_limits, joint_ranges, low_discrepancy_configurations, random_configurations
from .link_poses import joint_origins, link_frames
from .link_surface import LinkSurface, capsule_axes, link_capsules
from .placements import bearing_placement, found_xyz, joint_placement, link_placement, point_placement
from .relative import carrier_kinematics, relative_kinematics, relative_motion
from .rigid_motion import rigid_motion_columns
from .thermal_expansion import (
    Ends,
    at_temperature,
    carrier_ends,
    depends_on_temperature,
    expanded,
    link_vectors,
    point_ends,
    temperature_rise,
)
from .tool_rotations import rotation_freedom
from .triangle_meshes import box, cylinder, decimated, ellipsoid

__all__ = [
    "Ends",
    "JointMotion",
    "LinkSurface",
    "PointKinematics",
    "at_temperature",
    "bearing_placement",
    "box",
    "capsule_axes",
    "carrier_ends",
    "carrier_kinematics",
    "cylinder",
    "damped_step",
    "decimated",
    "depends_on_temperature",
    "ellipsoid",
    "expanded",
    "found_xyz",
    "joint_batch",
    "joint_limits",
    "joint_motion",
    "joint_origins",
    "joint_placement",
    "joint_positions",
    "joint_ranges",
    "link_capsules",
    "link_frames",
    "link_placement",
    "link_vectors",
    "loop_gap",
    "low_discrepancy_configurations",
    "motor_motion",
    "point_ends",
    "point_kinematics",
    "point_placement",
    "random_configurations",
    "reach_points",
    "relative_kinematics",
    "relative_motion",
    "rigid_motion_columns",
    "rotation_freedom",
    "temperature_rise",
]
