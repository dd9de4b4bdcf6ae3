from .base_placement import base_errors
from .elastic_prior import ElasticPrior
from .fleet_prior import OF_THE_CELL, FleetPrior, prior_covariance
from .gauge_freedom import (
    KNOWN_POINT_STD,
    point_uncertainty,
    probable_robot,
    probable_robots,
    with_calibrated_points,
)
from .geometric_calibration import GeometricFit, fit_geometry
from .least_squares_problem import LossName
from .point_fit import CONVERGED
from .stratified_sample import StratifiedSample, all_errors
from .temperature_evidence import TemperatureEvidence, sensor_scatter
from .terms import (
    LEAST_COORDINATES,
    LEAST_POSES,
    LEVELS,
    PER_JOINT,
    TOLERANCE,
    common_lengths,
    coordinates,
    declared_size,
    enough_for_terms,
    free_joints,
    geometric_parameters,
    loaded_compliances,
    manufacturing_tolerances,
    moving_joints,
    plausible_size,
)
from .thermal_terms import THERMAL, is_thermal, thermal_parameters, with_reference_temperature
from .tolerance_prior import LENGTH_TOLERANCE, are_tracked, error_kind, with_tolerance_prior

__all__ = [
    "CONVERGED",
    "KNOWN_POINT_STD",
    "LEAST_COORDINATES",
    "LEAST_POSES",
    "LENGTH_TOLERANCE",
    "LEVELS",
    "OF_THE_CELL",
    "PER_JOINT",
    "THERMAL",
    "TOLERANCE",
    "ElasticPrior",
    "FleetPrior",
    "GeometricFit",
    "LossName",
    "StratifiedSample",
    "TemperatureEvidence",
    "all_errors",
    "are_tracked",
    "base_errors",
    "common_lengths",
    "coordinates",
    "declared_size",
    "enough_for_terms",
    "error_kind",
    "fit_geometry",
    "free_joints",
    "geometric_parameters",
    "is_thermal",
    "loaded_compliances",
    "manufacturing_tolerances",
    "moving_joints",
    "plausible_size",
    "point_uncertainty",
    "prior_covariance",
    "probable_robot",
    "probable_robots",
    "sensor_scatter",
    "thermal_parameters",
    "with_calibrated_points",
    "with_reference_temperature",
    "with_tolerance_prior",
]
