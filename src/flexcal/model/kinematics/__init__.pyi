from .forward import PointKinematics, joint_batch, point_kinematics
from .inverse import damped_step, reach_points
from .joint_space import joint_limits, joint_ranges, low_discrepancy_configurations
from .link_poses import joint_origins, link_frames
from .link_surface import LinkSurface
from .placements import bearing_placement, found_xyz, joint_placement, link_placement, point_placement
from .relative import carrier_kinematics, relative_kinematics, relative_motion

__all__ = [
    "LinkSurface",
    "PointKinematics",
    "bearing_placement",
    "carrier_kinematics",
    "damped_step",
    "found_xyz",
    "joint_batch",
    "joint_limits",
    "joint_origins",
    "joint_placement",
    "joint_ranges",
    "link_frames",
    "link_placement",
    "low_discrepancy_configurations",
    "point_kinematics",
    "point_placement",
    "reach_points",
    "relative_kinematics",
    "relative_motion",
]
