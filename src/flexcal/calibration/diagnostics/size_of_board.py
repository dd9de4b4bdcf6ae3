"""Size of a camera's board, seen against the nominal robot: a wrong one makes a robot of another size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import predict_measurements


def board_size(fit: GeometricFit) -> float | None:
    """Size of the board relative to the declared one at which positions of a camera on the hand fit the nominal robot best.

    Linear least squares of y_i s = B (x_i + A_i c) + t for the size s, the camera's place c on the hand and the board's place t, with the
    calibrated rotation B of the station, each view weighed by its noise. None where no camera on the hand measured.
    """
    poses, model = fit.poses.subset(fit.poses.seen), fit.model
    if not len(poses) or poses.camera is None:
        return None
    camera = model.config.measurements[str(poses.camera[0])]
    if camera.kind != "camera" or camera.mounted == "cell":
        return None
    geometry = model.geometry
    without = replace(
        geometry, errors=np.zeros_like(geometry.errors), origin_error=np.zeros_like(geometry.origin_error)
    )
    nominal = replace(model, geometry=without)
    at = predict_measurements(nominal, poses, elastic=False)
    places = np.array([poses.station == name for name in poses.stations], dtype=float)
    columns = [poses.position[:, :, None], -np.matmul(at.base, at.kinematics.orientation)]
    columns += [-place[:, None, None] * np.eye(3) for place in places]
    weight = 1 / np.linalg.norm(poses.sigma, axis=1)
    left = (weight[:, None, None] * np.concatenate(columns, axis=2)).reshape(3 * len(poses), -1)
    right = (weight[:, None] * np.matmul(at.base, at.kinematics.position[:, :, None])[:, :, 0]).ravel()
    return float(np.linalg.lstsq(left, right, rcond=None)[0][0])
