"""Stage 1: from frequency responses to the stiffness and damping of drives and bearings, with true uncertainties."""

from flexcal.elasticity.identify import StiffnessResult, identify_stiffness
from flexcal.elasticity.model_error import Tolerances
from flexcal.elasticity.parameters import stage_one_parameters
from flexcal.elasticity.periodic_response import reference_shift
from flexcal.elasticity.prediction import ResponseModel
from flexcal.elasticity.reference_motion import ReferenceMotion
from flexcal.elasticity.search import MultiStart, PopulationSearch, Search
from flexcal.elasticity.weighting import CovarianceWeighting, PaperWeighting, UniformWeighting, Weighting
from flexcal.model.names import spring_names

__all__ = [
    "CovarianceWeighting",
    "MultiStart",
    "PaperWeighting",
    "PopulationSearch",
    "ReferenceMotion",
    "ResponseModel",
    "Search",
    "StiffnessResult",
    "Tolerances",
    "UniformWeighting",
    "Weighting",
    "identify_stiffness",
    "reference_shift",
    "spring_names",
    "stage_one_parameters",
]
