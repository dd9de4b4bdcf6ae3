from .equations import PayloadEquations
from .flexibility_correction import FlexibilityCorrection, error_sources
from .identification import BODY, PayloadFit, identify_payload
from .robot_prior import RobotPrior

__all__ = [
    "BODY",
    "FlexibilityCorrection",
    "PayloadEquations",
    "PayloadFit",
    "RobotPrior",
    "error_sources",
    "identify_payload",
]
