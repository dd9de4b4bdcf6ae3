from .multisines import MultisinePlan
from .page_path import page_beside
from .periodic_paths import FourierPaths, SplinePaths, fourier_basis, spline_basis
from .plan_files import Plan, read_plan, read_plan_of, write_plan
from .poses import OVERTRAVEL, PosePlan
from .timed_positions import TimedPositions
from .trajectories import TrajectoryPlan

__all__ = [
    "OVERTRAVEL",
    "FourierPaths",
    "MultisinePlan",
    "Plan",
    "PosePlan",
    "SplinePaths",
    "TimedPositions",
    "TrajectoryPlan",
    "fourier_basis",
    "page_beside",
    "read_plan",
    "read_plan_of",
    "spline_basis",
    "write_plan",
]
