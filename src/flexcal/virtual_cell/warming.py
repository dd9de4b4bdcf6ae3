"""Temperature of the virtual arm while its poses are measured."""

from __future__ import annotations

import numpy as np

from flexcal.virtual_cell.config import MismatchConfig

COLD = 20.0
"""Temperature, °C, at which the arm has its true geometry."""
INTERVAL = 60.0
"""Time, s, from one pose to the next."""
_CONSTANTS, _CYCLES = 3.0, 2.0
"""Time constants that an arm warms up for, and how often it warms up and cools down."""


def changes_with_temperature(mismatch: MismatchConfig) -> bool:
    """Whether anything of the cell changes with temperature, which is then measured too."""
    return max(mismatch.temperature_drift, mismatch.link_growth, mismatch.zero_drift) > 0


def temperature_share(mismatch: MismatchConfig, poses: int) -> np.ndarray:
    """Share (poses,) of the whole rise of temperature at every pose, from 0 to 1."""
    share = np.linspace(0, 1, poses)
    if mismatch.temperature_profile == "warming":
        return (1 - np.exp(-_CONSTANTS * share)) / (1 - np.exp(-_CONSTANTS))
    if mismatch.temperature_profile == "cycling":
        return (1 - np.cos(2 * np.pi * _CYCLES * share)) / 2
    return share
