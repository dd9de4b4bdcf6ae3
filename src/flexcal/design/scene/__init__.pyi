from .clearance import Clearance
from .collision import CollisionChecker, is_hanging
from .measuring_setup import STANDARD, MeasuringSetup, TrackerNoise
from .rough_shape import RoughShape, below_base, has_collision_shapes
from .visibility import station_position, visible

__all__ = [
    "STANDARD",
    "Clearance",
    "CollisionChecker",
    "MeasuringSetup",
    "RoughShape",
    "TrackerNoise",
    "below_base",
    "has_collision_shapes",
    "is_hanging",
    "station_position",
    "visible",
]
