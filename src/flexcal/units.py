"""Conversion factors to SI."""

from math import pi

DEGREE = pi / 180.0
MILLIMETRE = 1e-3
LARGEST = 1e50
"""No quantity in SI units is as large: beyond, products of a few overflow."""


_FINEST = 3
"""Most decimals of millimetres."""
_LIMITS = (0.3, 1.0, 10.0)
"""Errors, mm, from which on a decimal less is meant."""


def decimals(millimetres: float | None) -> int:
    """Decimals of a number in mm that is told beside errors of this size: three below 0.3 mm, none from 10 mm on."""
    return _FINEST if millimetres is None else _FINEST - sum(millimetres >= limit for limit in _LIMITS)
