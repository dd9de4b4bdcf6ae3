from .drive_torque import DriveTorque, Hardened
from .friction_pulses import FrictionPulses
from .harmonic_balance import reference_shift
from .reference_motion import ReferenceMotion

__all__ = [
    "DriveTorque",
    "FrictionPulses",
    "Hardened",
    "ReferenceMotion",
    "reference_shift",
]
