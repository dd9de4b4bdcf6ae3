from .estimate import Dropped, Estimate
from .identifiability import Identifiability, analyse, name_direction
from .loss import Cauchy, Huber, Loss, Squares
from .misfit import Misfit
from .parameter import Parameter, Parameters
from .problem import Problem
from .profile import profile_rise
from .sensitivity import Sensitivity
from .solver import solve

__all__ = [
    "Cauchy",
    "Dropped",
    "Estimate",
    "Huber",
    "Identifiability",
    "Loss",
    "Misfit",
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
