"""Jumps in the readings of a wire or a face: it was zeroed, hung up or moved between two measurements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import GeometricFit

_WINDOW = 12
"""Number of measurements on either side of a jump that are compared."""
_CERTAIN = 10.0
"""Jump, in standard deviations of a difference of such means, that neither noise nor another region of the workspace explains."""
_MEDIAN = 0.6745


@dataclass(frozen=True)
class ReadingJump:
    """Change `size`, m, of the readings of a `station` between two measurements, by the numbers of their poses."""

    station: str
    before: int
    after: int
    size: float


def reading_jumps(fit: GeometricFit) -> tuple[ReadingJump, ...]:
    """Jumps of what a fit leaves of distances and contacts, the largest first.

    Medians of neighbouring measurements are compared, at the scatter of differences between successive ones, which a slow change does not
    touch.
    """
    poses, found = fit.poses, []
    if poses.kind is None:
        return ()
    for station in dict.fromkeys(poses.station[poses.kind != ""].tolist()):
        rows = np.flatnonzero((poses.station == station) & (poses.kind != ""))
        left = fit.residuals[rows].sum(axis=1)
        if len(rows) < 2 * _WINDOW:
            continue
        noise = float(np.median(np.abs(np.diff(left)))) / _MEDIAN / np.sqrt(2)
        sides = np.array(
            [np.median(left[k : k + _WINDOW]) - np.median(left[k - _WINDOW : k]) for k in _middles(len(rows))]
        )
        size = np.abs(sides)
        while (k := int(np.argmax(size))) >= 0 and size[k] > _CERTAIN * noise * np.sqrt(2 / _WINDOW):
            row = k + _split(left[k : k + 2 * _WINDOW])
            before, after = poses.pose[rows[row - 1 : row + 1]].tolist()
            found.append(ReadingJump(station, before, after, float(sides[k])))
            size[max(0, k - _WINDOW) : k + _WINDOW] = 0.0
    return tuple(sorted(found, key=lambda jump: -abs(jump.size)))


def _split(values: np.ndarray) -> int:
    """Number of values in the first of the two parts that differ least from their medians."""

    def left(part: np.ndarray) -> float:
        return float(np.abs(part - np.median(part)).sum())

    return min(range(1, len(values)), key=lambda k: left(values[:k]) + left(values[k:]))


def _middles(count: int) -> range:
    return range(_WINDOW, count - _WINDOW + 1)
