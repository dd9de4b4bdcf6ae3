from .elastic_prior import ElasticPrior
from .gauge_freedom import POINT_KNOWN, found_point, point_uncertainty, probable_robot, probable_robots
from .geometric_calibration import Calibration, calibrate
from .least_squares_problem import LossName
from .stratified_sample import EvenSample, all_errors
from .terms import (
    LEAST_POSES,
    PER_JOINT,
    TOLERANCE,
    free_joints,
    geometric_parameters,
    loaded_compliances,
    moving_joints,
    tolerances,
)

__all__ = [
    "LEAST_POSES",
    "PER_JOINT",
    "POINT_KNOWN",
    "TOLERANCE",
    "Calibration",
    "ElasticPrior",
    "EvenSample",
    "LossName",
    "all_errors",
    "calibrate",
    "found_point",
    "free_joints",
    "geometric_parameters",
    "loaded_compliances",
    "moving_joints",
    "point_uncertainty",
    "probable_robot",
    "probable_robots",
    "tolerances",
]
