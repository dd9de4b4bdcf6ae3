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

__all__ = [
    "CLASSIC",
    "BaseParameters",
    "Column",
    "Coulomb",
    "Coupling",
    "DriveTerm",
    "Motion",
    "Observation",
    "RotorInertia",
    "TorqueOffset",
    "Viscous",
]
