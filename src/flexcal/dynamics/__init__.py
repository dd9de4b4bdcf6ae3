"""Recordings to dynamic parameters: base parameters, drive terms, least squares with intervals."""

from flexcal.dynamics.base_parameters import BaseParameters
from flexcal.dynamics.drive_terms import (
    CLASSIC,
    Column,
    Coulomb,
    Coupling,
    DriveTerm,
    RotorInertia,
    TorqueOffset,
    Viscous,
)
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.ols import ordinary_least_squares
from flexcal.dynamics.prior_fit import identify_with_prior
from flexcal.dynamics.regression import RegressionData, Subsystem, Window, observe
from flexcal.dynamics.triangle import Triangle
from flexcal.dynamics.wls import weighted_least_squares

__all__ = [
    "CLASSIC",
    "BaseParameters",
    "Column",
    "Coulomb",
    "Coupling",
    "DriveTerm",
    "Motion",
    "Observation",
    "RegressionData",
    "RotorInertia",
    "Subsystem",
    "TorqueOffset",
    "Triangle",
    "Viscous",
    "Window",
    "identify_with_prior",
    "observe",
    "ordinary_least_squares",
    "weighted_least_squares",
]
