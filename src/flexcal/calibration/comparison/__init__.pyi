from .explanations import Explanation
from .geometry_change import GeometryChange, ParameterShift, compare_geometry

__all__ = [
    "Explanation",
    "GeometryChange",
    "ParameterShift",
    "compare_geometry",
]
