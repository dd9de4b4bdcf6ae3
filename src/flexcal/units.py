"""Conversion factors to SI."""

from math import pi

DEGREE = pi / 180.0
MILLIMETRE = 1e-3
