from .chi_square import chi_square_limit
from .conic_constraint import Cone
from .conic_least_squares import ConicFit
from .estimate import Dropped, Estimate
from .f_distribution import f_tail
from .gaussian_distance import distance_probability, distance_quantile, mean_distance, principal_variances
from .hierarchical_model import Measured, Population, individuals, population
from .identifiability import RANK_TOLERANCE, Identifiability, analyse, name_direction
from .individual_deviations import deviations
from .loss import Cauchy, Huber, Loss, Squares, loss_named
from .misfit import Misfit
from .objective import NotFinite
from .parameter import Parameter, Parameters
from .problem import Problem
from .profile_likelihood import profile_cost_increase
from .sensitivity import Sensitivity
from .solver import solve
from .student_t import student_quantile
from .trimmed_squares import consistent_groups, core_size
from .two_variances import TwoVarianceFit, fit_two_variances, least_squares_of_two_variances
from .uncertainty import LOG_STD_LIMIT, is_log_identified
from .vuong_test import vuong_statistic

__all__ = [
    "LOG_STD_LIMIT",
    "RANK_TOLERANCE",
    "Cauchy",
    "Cone",
    "ConicFit",
    "Dropped",
    "Estimate",
    "Huber",
    "Identifiability",
    "Loss",
    "Measured",
    "Misfit",
    "NotFinite",
    "Parameter",
    "Parameters",
    "Population",
    "Problem",
    "Sensitivity",
    "Squares",
    "TwoVarianceFit",
    "analyse",
    "chi_square_limit",
    "consistent_groups",
    "core_size",
    "deviations",
    "distance_probability",
    "distance_quantile",
    "f_tail",
    "fit_two_variances",
    "individuals",
    "is_log_identified",
    "least_squares_of_two_variances",
    "loss_named",
    "mean_distance",
    "name_direction",
    "population",
    "principal_variances",
    "profile_cost_increase",
    "solve",
    "student_quantile",
    "vuong_statistic",
]
