from .calibrate import CalibrateStep
from .compare import CompareStep
from .measure import MeasureStep
from .plan import PlanStep
from .robot import RobotStep
from .verify import VerifyStep

__all__ = [
    "CalibrateStep",
    "CompareStep",
    "MeasureStep",
    "PlanStep",
    "RobotStep",
    "VerifyStep",
]
