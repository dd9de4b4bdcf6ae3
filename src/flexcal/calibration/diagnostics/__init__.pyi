from .bearing_axes import BearingAxes, compare_bearings
from .drift_test import Drift
from .gravity_residuals import GravityLoads, gravity_loads
from .plausibility import ImplausibleShift, implausible_shifts, is_implausible, residuals_implausible

__all__ = [
    "BearingAxes",
    "Drift",
    "GravityLoads",
    "ImplausibleShift",
    "compare_bearings",
    "gravity_loads",
    "implausible_shifts",
    "is_implausible",
    "residuals_implausible",
]
