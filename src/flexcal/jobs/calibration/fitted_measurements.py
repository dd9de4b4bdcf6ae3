"""Comparison of measured points with those that a calibration was fitted to."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.files.formats import sha256_of
from flexcal.jobs.inputs import CalibratedRobot

_RESOLUTION = 1e-7
"""Difference, rad or m, below which measurements count as the same, in whatever file and unit they are."""


def measurement_digests(poses: PoseSet) -> tuple[str, ...]:
    """Digest of eight hexadecimal digits for every measurement, from its joint positions and its point."""
    return tuple(_digests(poses))


def _digests(poses: PoseSet) -> Iterator[str]:
    rows = np.round(np.hstack([poses.q, poses.position]) / _RESOLUTION).astype("<i8")
    return (f"{zlib.crc32(row.tobytes()):08x}" for row in rows)


def fitted_files(calibrated: CalibratedRobot, files: Sequence[Path]) -> tuple[str, ...]:
    """Names of those of the `files` that the calibration was made from."""
    known = calibrated.blocks["calibration"].provenance.values()
    return tuple(file.name for file in files if sha256_of(file) in known)


def fitted_points(calibrated: CalibratedRobot, poses: PoseSet) -> tuple[str, ...]:
    """Number of `poses` that the calibration was fitted to, in words; empty for none."""
    fitted = set(calibrated.blocks["calibration"].measurements)
    again = sum(digest in fitted for digest in _digests(poses))
    return (f"{again} of these {len(poses)} points",) if again else ()
