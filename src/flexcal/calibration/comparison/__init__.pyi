from .explanations import Explanation
from .geometry_change import GeometryChange, ParameterShift, compare_geometry
from .geometry_over_time import GeometryTrend, geometry_courses
from .thermal_growth import ALUMINIUM, GROWTH, TEMPERATURE, temperature_of

__all__ = [
    "ALUMINIUM",
    "GROWTH",
    "TEMPERATURE",
    "Explanation",
    "GeometryChange",
    "GeometryTrend",
    "ParameterShift",
    "compare_geometry",
    "geometry_courses",
    "temperature_of",
]
