"""A frequency experiment that takes seconds."""

from dataclasses import replace

import numpy as np

from flexcal import MultisinePlan


def small_plan(whole: MultisinePlan) -> MultisinePlan:
    """Two poses of a plan, on 15 lines of 1 Hz, in three periods of three realisations."""
    lines = np.arange(3, 60, 4)
    return replace(
        whole,
        poses=whole.poses[:2],
        base_frequency_hz=1.0,
        lines=lines,
        amplitude=np.repeat(whole.amplitude[:, :1], len(lines), axis=1),
        periods=3,
        settle_periods=1,
        realisations=3,
        reference_frequency_hz=1.5,
        rate_hz=1000.0,
    )
