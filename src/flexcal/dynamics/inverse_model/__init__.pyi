from .base_parameters import BaseParameters
from .bearing_spring import BearingSpring
from .drive_spring import DriveBacklash, DriveSpring
from .drive_terms import (
    CLASSIC,
    Column,
    Coulomb,
    Coupling,
    DriveTerm,
    JointSprings,
    Memory,
    RotorInertia,
    TorqueOffset,
    Viscous,
)
from .equations import Equations
from .motor_axis import MotorAxis, motor_axes, motor_shares
from .observation import Observation
from .sensor_offset import SensorOffset

__all__ = [
    "CLASSIC",
    "BaseParameters",
    "BearingSpring",
    "Column",
    "Coulomb",
    "Coupling",
    "DriveBacklash",
    "DriveSpring",
    "DriveTerm",
    "Equations",
    "JointSprings",
    "Memory",
    "MotorAxis",
    "Observation",
    "RotorInertia",
    "SensorOffset",
    "TorqueOffset",
    "Viscous",
    "motor_axes",
    "motor_shares",
]
