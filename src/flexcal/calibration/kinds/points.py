"""Points: a tracker, a coordinate measuring arm, or another instrument of three coordinates."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.kinds.kind import Kind
from flexcal.data.poses import PoseSet


class Points(Kind):
    """Coordinates of a target in the station's axes."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.located & ~poses.seen
