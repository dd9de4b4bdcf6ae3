from .bearing_axes import ResponseBearings
from .search import MultiStart, PopulationSearch, Search
from .spring_fit import SpringFit, fit_springs

__all__ = [
    "MultiStart",
    "PopulationSearch",
    "ResponseBearings",
    "Search",
    "SpringFit",
    "fit_springs",
]
