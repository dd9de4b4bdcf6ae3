from .bayesian_fit import fit_inertials
from .torque_error import TrajectoryTorques, relative_torque_error, trajectory_torques

__all__ = [
    "TrajectoryTorques",
    "fit_inertials",
    "relative_torque_error",
    "trajectory_torques",
]
