from .equations import PayloadEquations
from .flexibility_correction import FlexibilityCorrection, uncertain_parameters
from .identification import BODY, PayloadFit, fit_payload
from .robot_prior import RobotPrior

__all__ = [
    "BODY",
    "FlexibilityCorrection",
    "PayloadEquations",
    "PayloadFit",
    "RobotPrior",
    "fit_payload",
    "uncertain_parameters",
]
