from .clearance import Clearance
from .collision import CollisionChecker
from .measuring_setup import STANDARD, MeasuringSetup, TrackerNoise
from .visibility import station_position, visible

__all__ = [
    "STANDARD",
    "Clearance",
    "CollisionChecker",
    "MeasuringSetup",
    "TrackerNoise",
    "station_position",
    "visible",
]
