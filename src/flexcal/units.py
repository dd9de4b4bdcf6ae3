"""Conversion factors to SI."""

from math import pi

DEGREE = pi / 180.0
MILLIMETRE = 1e-3
INCH = 25.4e-3
LARGEST = 1e50
"""No quantity in SI units is as large: beyond, products of a few overflow."""
SMALLEST = 1e-50
"""Numbers nearer to zero are zero: beyond, quotients overflow."""
LEAST_STD = 1e-12
"""No instrument's standard deviation is as small, m or rad."""
FELT = 1e-5
"""Displacement of a tool, m, to which the best robots repeat: less is no error of one."""

COLDEST, HOTTEST = -50.0, 150.0
"""Temperatures of an arm, °C: no robot works beyond."""
_KELVIN = (200.0, 400.0)


_FINEST = 3
"""Most decimals of millimetres."""
_LIMITS = (0.3, 1.0, 10.0)
"""Errors, mm, from which on a decimal less is meant."""


def temperature_fault(value: float) -> str:
    """What is wrong with a temperature of an arm in °C, as the end of a sentence on it; empty where it may be one."""
    if COLDEST <= value <= HOTTEST:
        return ""
    advice = "it looks like kelvin, so subtract 273.15" if _KELVIN[0] < value < _KELVIN[1] else "correct it"
    return f"is {value:g}, but must be from {COLDEST:g} to {HOTTEST:g} °C; {advice}."


def decimals(millimetres: float | None) -> int:
    """Decimals of a number in mm that is told beside errors of this size: three below 0.3 mm, none from 10 mm on."""
    return _FINEST if millimetres is None else _FINEST - sum(millimetres >= limit for limit in _LIMITS)
