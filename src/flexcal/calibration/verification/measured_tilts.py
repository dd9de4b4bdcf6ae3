"""Readings of inclinometers, beside those that the robot predicts before and after a calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.kinds import Directions
from flexcal.calibration.measurement import predict_measurements, register, with_target_axes
from flexcal.data.poses import PoseSet
from flexcal.model.robot import VERTICAL, RobotModel

_STEPS, _SMALL = 20, 1e-9
MILLIRADIAN = 1e-3


@dataclass(frozen=True)
class TiltStatistics:
    """Root mean square, mean, 90th percentile and largest size of differences of `readings`, rad or 1, at `poses` poses."""

    poses: int
    readings: int
    rms: float
    mean: float
    p90: float
    max: float

    @classmethod
    def of(cls, tilts: np.ndarray) -> TiltStatistics:
        """Statistics of differences (K, 3); NaN for axes without a reading."""
        read = np.abs(tilts[np.isfinite(tilts)])
        return cls(
            len(tilts),
            len(read),
            float(np.sqrt(np.mean(read**2))),
            float(read.mean()),
            float(np.quantile(read, 0.9)),
            float(read.max()),
        )

    def document(self) -> dict[str, float]:
        """Entry of results.json, mrad."""
        sizes = {"rms": self.rms, "mean": self.mean, "p90": self.p90, "max": self.max}
        return {"poses": self.poses} | {f"{key}_mrad": size / MILLIRADIAN for key, size in sizes.items()}


@dataclass(frozen=True, eq=False)
class MeasuredTilts:
    """Readings of inclinometers at K poses: numbers `pose` (K,), joint positions `q` (K, n), names `sensor` (K,), and the differences
    (K, 3) from the robot `before` and as `calibrated`, measured minus predicted, rad or 1; NaN for axes without a reading.
    """

    pose: np.ndarray
    q: np.ndarray
    sensor: np.ndarray
    before: np.ndarray
    calibrated: np.ndarray

    @classmethod
    def of(cls, nominal: RobotModel, poses: PoseSet, tilts: np.ndarray) -> MeasuredTilts:
        """Differences `tilts` (K, 3) that a fit to `poses` leaves, and those of the `nominal` robot with mounting, zeros and inclination of
        the base fitted.
        """
        own = poses.subset(poses.tilted)
        return cls(own.pose, own.q, own.target, uncalibrated_tilts(nominal, own), tilts)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the inclinometers, in the order in which they appear."""
        return tuple(dict.fromkeys(self.sensor.tolist()))


def uncalibrated_tilts(nominal: RobotModel, poses: PoseSet) -> np.ndarray:
    """Differences (K, 3) of the readings from the nominal robot's, with mountings, zeros and inclination of the base fitted to them."""
    model = nominal.with_stations(poses.places)
    model = with_target_axes(register(model, poses, np.zeros_like(poses.position)), poses)
    kind = Directions()
    names = [f"station.{VERTICAL}.{key}" for key in kind.place(model, poses, VERTICAL, turned=True)]
    for sensor in poses.targets:
        names += [f"point.{sensor}.{key}" for key in kind.target_parameters(poses, sensor)]
    for _ in range(_STEPS):
        at = predict_measurements(model, poses, elastic=False, jacobians=True)
        step = np.linalg.lstsq(at.jacobian(names).reshape(-1, len(names)), at.residual.ravel(), rcond=1e-9)[0]
        model = model.with_values({n: model.value(n) + float(d) for n, d in zip(names, step, strict=True)})
        if np.abs(step).max() < _SMALL:
            break
    return tilt_differences(model, poses)


def tilt_differences(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Readings minus those that `model` predicts (K, 3), rad or 1, of `poses` of inclinometers; NaN for axes without a reading."""
    assert poses.tilt is not None
    left = predict_measurements(model, poses).residual[len(poses) :]
    return np.where(np.isfinite(poses.tilt), left, np.nan)
