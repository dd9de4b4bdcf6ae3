"""Check that the measurements of a calibration are points."""

from __future__ import annotations

from flexcal.data import PoseSet
from flexcal.errors import FlexcalError


def require_points(poses: PoseSet, where: str = "the poses") -> None:
    """Raise `FlexcalError` for what is measured beside or in place of points and would be left out; `where` names the files."""
    if poses.length is not None:
        raise FlexcalError(f"{where}: lengths of a wire cannot be used yet; give points x, y, z.")
    if poses.quaternion_wxyz is not None:
        raise FlexcalError(
            f"{where}: measured orientations cannot be used yet; take out the columns qw, qx, qy, qz to use the points alone."
        )
