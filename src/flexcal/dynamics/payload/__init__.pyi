from .equations import PayloadEquations
from .flexibility_correction import FlexibilityCorrection, uncertain_parameters
from .identification import BODY, PayloadFit, identify_payload
from .robot_prior import RobotPrior

__all__ = [
    "BODY",
    "FlexibilityCorrection",
    "PayloadEquations",
    "PayloadFit",
    "RobotPrior",
    "identify_payload",
    "uncertain_parameters",
]
