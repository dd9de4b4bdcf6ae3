"""Estimation from whitened residuals: parameters, least squares, uncertainty, identifiability. Knows nothing of robots."""

from flexcal.estimation.estimate import Dropped, Estimate
from flexcal.estimation.identifiability import Identifiability, analyse, name_direction
from flexcal.estimation.loss import Cauchy, Huber, Loss, Squares
from flexcal.estimation.parameter import Parameter, Parameters
from flexcal.estimation.problem import Problem
from flexcal.estimation.profile import profile_rise
from flexcal.estimation.sensitivity import Sensitivity
from flexcal.estimation.solve import solve

__all__ = [
    "Cauchy",
    "Dropped",
    "Estimate",
    "Huber",
    "Identifiability",
    "Loss",
    "Parameter",
    "Parameters",
    "Problem",
    "Sensitivity",
    "Squares",
    "analyse",
    "name_direction",
    "profile_rise",
    "solve",
]
