from .bearing_axes import ResponseBearings
from .search import MultiStart, PopulationSearch, Search
from .stiffness import StiffnessResult, identify_stiffness

__all__ = [
    "MultiStart",
    "PopulationSearch",
    "ResponseBearings",
    "Search",
    "StiffnessResult",
    "identify_stiffness",
]
