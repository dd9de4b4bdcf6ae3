from .explanations import Explanation
from .geometry_change import GeometryChange, ParameterShift, compare_geometry
from .geometry_over_time import GeometryTrend, geometry_courses

__all__ = [
    "Explanation",
    "GeometryChange",
    "GeometryTrend",
    "ParameterShift",
    "compare_geometry",
    "geometry_courses",
]
