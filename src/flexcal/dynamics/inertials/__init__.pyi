from .bayesian_fit import identify_with_prior
from .torque_error import trajectory_error

__all__ = [
    "identify_with_prior",
    "trajectory_error",
]
