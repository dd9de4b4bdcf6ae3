"""Factors from the units people write to SI, which is all that flexcal computes in."""

from math import pi

DEGREE = pi / 180.0
MILLIMETRE = 1e-3
