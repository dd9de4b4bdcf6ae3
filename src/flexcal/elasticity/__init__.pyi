from .identify import StiffnessResult, identify_stiffness
from .model_error import Tolerances
from .parameters import stage_one_parameters
from .periodic_response import reference_shift
from .prediction import ResponseModel
from .reference_motion import ReferenceMotion
from .response_bearings import ResponseBearings
from .search import MultiStart, PopulationSearch, Search
from .weighting import CovarianceWeighting, PaperWeighting, UniformWeighting, Weighting

__all__ = [
    "CovarianceWeighting",
    "MultiStart",
    "PaperWeighting",
    "PopulationSearch",
    "ReferenceMotion",
    "ResponseBearings",
    "ResponseModel",
    "Search",
    "StiffnessResult",
    "Tolerances",
    "UniformWeighting",
    "Weighting",
    "identify_stiffness",
    "reference_shift",
    "stage_one_parameters",
]
