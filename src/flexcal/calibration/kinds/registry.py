"""The kinds that there are."""

from __future__ import annotations

from flexcal.calibration.kinds.directions import Directions
from flexcal.calibration.kinds.distances import Distances
from flexcal.calibration.kinds.kind import Kind
from flexcal.calibration.kinds.lines import Lines
from flexcal.calibration.kinds.orientations import Orientations
from flexcal.calibration.kinds.planes import Planes
from flexcal.calibration.kinds.points import Points
from flexcal.calibration.kinds.sockets import Sockets
from flexcal.calibration.kinds.views import Views
from flexcal.data.poses import PoseSet

LOCATING: tuple[Kind, ...] = (Points(), Sockets(), Views(), Distances(), Planes(), Lines())
"""Kinds that read where a target is; each row of a pose set is of one of them."""
ANGULAR: tuple[Kind, ...] = (Orientations(), Directions())
"""Kinds that read how it is turned, alone or beside its place."""
KINDS = (*LOCATING, *ANGULAR)


def kind_of(poses: PoseSet, station: str) -> Kind:
    """Kind of the readings from a station."""
    own = poses.station == station
    return next(kind for kind in KINDS if (kind.rows(poses) & own).any())


def tells_lengths(poses: PoseSet) -> bool:
    """Whether any reading tells how large the robot is, which contacts do not, nor sockets without a known distance."""
    return any(kind.tells_lengths(poses) for kind in KINDS)
