"""Rows whose temperature cannot be the arm's beside those of the others, as a sensor that fails for a moment gives them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.report.layout import listed

_FAR = 10.0
"""Distance, K, from the others that no arm covers between two measurements."""
_SCATTERS = 4.0
_NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
_MOST = 0.2
"""Share of the rows from which they are no exceptions."""
_LISTED = 5
_WARM = 60.0
"""Temperature, °C, that arms seldom have, and that values in Fahrenheit often exceed."""


def plausible_temperatures(poses: PoseSet) -> np.ndarray:
    """Mask (N,) without the rows whose temperature is far from the median and from those measured before and after it.

    Far is 10 K, and four robust standard deviations. Equal temperatures that follow each other count as one, so that a sensor that is dead
    for a while is found too; an arm that starts cold has temperatures between.
    """
    kept = np.ones(len(poses), bool)
    if poses.temperature is None:
        return kept
    order = np.arange(len(poses)) if poses.time is None else np.argsort(poses.time, kind="stable")
    values = poses.temperature[order]
    median = float(np.median(values))
    far = max(_FAR, _SCATTERS * _NORMAL * float(np.median(np.abs(values - median))))
    starts = np.flatnonzero(np.append(True, np.diff(values) != 0))
    runs = values[starts]
    step = np.abs(np.diff(runs))
    apart = np.minimum(np.append(np.inf, step), np.append(step, np.inf))
    odd = (np.abs(runs - median) > far) & (apart > far) & np.isfinite(apart)
    rows = order[np.repeat(odd, np.diff(np.append(starts, len(values))))]
    if len(rows) <= _MOST * len(poses):
        kept[rows] = False
    return kept


def with_plausible_temperatures(poses: PoseSet, kept: np.ndarray) -> PoseSet:
    """Poses of the rows `kept` (N,), with a note on those left out, and on temperatures that look like Fahrenheit."""
    if poses.temperature is None:
        return poses
    notes = list(poses.notes)
    median = float(np.median(poses.temperature))
    if not kept.all():
        out = np.flatnonzero(~kept)
        told = [f"row {row + 1}, pose {poses.pose[row]} ({poses.temperature[row]:.1f} °C)" for row in out]
        notes.append(
            f"left out, because the temperature is far from those before and after it and from the median of {median:.1f} °C: "
            f"{listed(told, _LISTED)}; correct the column 'temperature' there to use them"
        )
    highest = float(poses.temperature[kept].max())
    if highest > _WARM:
        notes.append(
            f"the column 'temperature' is up to {highest:.1f}, taken as °C, which is warm for an arm: if it is in Fahrenheit, declare "
            "`unit: degF` for it under `signals:` of robot.yaml, else expansion and temperatures are wrong"
        )
    return replace(poses.subset(kept) if not kept.all() else poses, notes=tuple(dict.fromkeys(notes)))
