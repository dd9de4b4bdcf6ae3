from .calibration import Calibration, calibrate, verify
from .cell import VirtualCell
from .data import PoseSet, Recording, read_poses
from .elasticity import identify_stiffness
from .errors import FlexcalError, InputError
from .estimation import Estimate
from .frequency import FrequencyResponse, frequency_response
from .model import RobotModel, point_kinematics, static_equilibrium

__version__: str

__all__ = [
    "Calibration",
    "Estimate",
    "FlexcalError",
    "FrequencyResponse",
    "InputError",
    "PoseSet",
    "Recording",
    "RobotModel",
    "VirtualCell",
    "calibrate",
    "frequency_response",
    "identify_stiffness",
    "point_kinematics",
    "read_poses",
    "static_equilibrium",
    "verify",
]
