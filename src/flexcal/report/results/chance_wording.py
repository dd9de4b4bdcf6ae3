"""Probabilities of tests in words."""

from __future__ import annotations

import math


def chance_in_words(probability: float, least: float = 1e-6) -> str:
    """p = 0.41, or p < 1e-06 below the `least` probability that is told."""
    if math.isnan(probability):
        return "p not known"
    return f"p < {least:.0e}".replace("e-0", "e-") if probability < least else f"p = {probability:.2g}"
