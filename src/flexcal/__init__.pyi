from .calibration.fit import Calibration, calibrate
from .calibration.verification import verify
from .data.poses import PoseSet, read_poses
from .data.recordings import Recording
from .elasticity.identification import identify_stiffness
from .errors import FlexcalError, InputError
from .estimation import Estimate
from .frequency.periodic import FrequencyResponse, frequency_response
from .model.kinematics import point_kinematics
from .model.robot import RobotModel
from .model.statics import static_equilibrium
from .virtual_cell import VirtualCell

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
