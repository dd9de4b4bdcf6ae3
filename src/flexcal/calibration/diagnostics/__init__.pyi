from .bearing_axes import BearingAxes, compare_bearings
from .drift_test import Drift
from .gravity_residuals import GravityLoads, gravity_loads
from .plausibility import Moved, hardly_fits, moved_far, scattered

__all__ = [
    "BearingAxes",
    "Drift",
    "GravityLoads",
    "Moved",
    "compare_bearings",
    "gravity_loads",
    "hardly_fits",
    "moved_far",
    "scattered",
]
