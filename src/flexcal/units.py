"""Conversion factors to SI."""

from math import pi

DEGREE = pi / 180.0
MILLIMETRE = 1e-3
LARGEST = 1e50
"""No quantity in SI units is as large: beyond, products of a few overflow."""
