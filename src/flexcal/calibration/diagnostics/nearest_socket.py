"""Which of all sockets, at all places of the fixture, the ball was nearest to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import predict_measurements
from flexcal.model.parts import vector_rotation
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class NearestSocket:
    """Socket at a place of the fixture that is nearest to the ball of one row, at a `distance`, m."""

    place: str
    socket: str
    distance: float

    def document(self) -> dict[str, str | float]:
        """Block of a JSON document."""
        return {"place": self.place, "socket": self.socket, "distance_mm": self.distance / MILLIMETRE}


def nearest_sockets(fit: GeometricFit, rows: Sequence[int]) -> tuple[NearestSocket, ...]:
    """Nearest sockets of the rows with these indices, the positions of the ball being those of the fitted robot."""
    poses, model = fit.poses, fit.model
    assert poses.socket is not None and poses.holder is not None
    held = np.flatnonzero(poses.in_socket)
    scale = dict(zip(model.stations.fixtures, 1 + model.stations.socket_scale, strict=True))
    known = {
        (str(poses.station[k]), str(poses.socket[k])): scale[poses.holder[k]] * poses.position[k]
        for k in held
    }
    sockets = []
    for (place, _), position in known.items():
        pose = model.stations.pose[model.station_index(place)]
        sockets.append((position - pose[:3]) @ vector_rotation(pose[3:]))
    chosen = poses.subset(rows)
    at = predict_measurements(model, chosen, flank=fit.flank[list(rows)], elastic=bool(model.elastic))
    distances = np.linalg.norm(at.kinematics.position[:, None] - np.array(sockets), axis=2)
    names = list(known)
    return tuple(
        NearestSocket(place=names[k][0], socket=names[k][1], distance=float(own[k]))
        for own, k in zip(distances, distances.argmin(axis=1), strict=True)
    )
