from .drive_torque import DriveTorque, HardenedStiffness
from .friction_pulses import FrictionPulses
from .harmonic_balance import reference_shift
from .reference_motion import ReferenceMotion
from .slipping_springs import SlippingSprings

__all__ = [
    "DriveTorque",
    "FrictionPulses",
    "HardenedStiffness",
    "ReferenceMotion",
    "SlippingSprings",
    "reference_shift",
]
