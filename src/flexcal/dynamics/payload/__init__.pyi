from .equations import PayloadEquations
from .flexibility_correction import ArmYield, error_sources
from .identification import BODY, PayloadFit, identify_payload
from .robot_prior import RobotPrior

__all__ = [
    "BODY",
    "ArmYield",
    "PayloadEquations",
    "PayloadFit",
    "RobotPrior",
    "error_sources",
    "identify_payload",
]
