"""Description of a misfit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misfit:
    """Pose, band and motor where the residual of a fit to frequency responses exceeds its predicted size.

    `reduced_chi2` of all data; `peak` is the largest mean square of the whitened residual over a band from `low_hz` to `high_hz` of one
    pose (its number counts from 1), where 1 is expected; `axis` is the joint whose motor answers there with the largest error, or "sensor
    NAME" where that of a sensor on the arm is larger. `far` are stiffnesses that ended more than a factor of 3 from their start.
    `inertials`: how far masses and centres of mass moved, root mean square in standard deviations of what was known of them before, 0
    where chance may have moved them. `severe`: parameters and their intervals are not to be relied on.
    """

    reduced_chi2: float
    peak: float
    pose: int
    low_hz: float
    high_hz: float
    axis: str
    far: tuple[str, ...] = ()
    inertials: float = 0.0
    severe: bool = False
