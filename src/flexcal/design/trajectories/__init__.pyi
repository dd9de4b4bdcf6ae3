from .criterion import TrajectoryCriterion
from .excitation_problem import NEAR
from .limit_usage import MotionLimits
from .motion_space import Kind
from .optimisation import TrajectoryDesign, optimise_trajectories
from .regressor_columns import BaseRegressor
from .required_limits import COULOMB, VISCOUS, require_stated_limits, with_assumed_friction
from .rest_to_rest import TimedMotion, timed_motion
from .sequences import SequenceName, sequence

__all__ = [
    "COULOMB",
    "NEAR",
    "VISCOUS",
    "BaseRegressor",
    "Kind",
    "MotionLimits",
    "SequenceName",
    "TimedMotion",
    "TrajectoryCriterion",
    "TrajectoryDesign",
    "optimise_trajectories",
    "require_stated_limits",
    "sequence",
    "timed_motion",
    "with_assumed_friction",
]
