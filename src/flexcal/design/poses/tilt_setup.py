"""Inclinometer for which a plan of poses may be: poses in its range, and what its readings tell there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.kinds import turn_to_z
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import DIRECTION, PoseSet
from flexcal.model.robot import STATION, VERTICAL, ZEROS, InclinometerConfig, RobotModel

_STD = 1e-4
"""Standard deviation of a reading, rad or 1, where none is declared."""
_TILTED, _ZERO = 0.02, 0.01
"""Standard deviations, rad, of mounting and inclination of the base, and of the reading of a level axis."""
_STEEPEST = np.deg2rad(75)
"""Elevation of an axis, rad, beyond which it says little of its own zero, and the readings of many sensors are poor."""


@dataclass(frozen=True, eq=False)
class TiltSetup:
    """Inclinometer by its `name` under `measurements:`, with its `config`; axes x and y, and z too of one that reads components."""

    name: str
    config: InclinometerConfig

    touched = False
    tells_base = False

    def nuisances(self, _target: str) -> dict[str, float]:
        """Inclination of the base, mounting and zeros, with their standard deviations beforehand."""
        base = {} if self.config.level else {f"station.{VERTICAL}.{key}": _TILTED for key in STATION[3:5]}
        mounting = {f"point.{self.name}.{key}": _TILTED for key in STATION[3:]}
        zeros = {f"point.{self.name}.{key}": _ZERO for key in ZEROS[: self._axes]}
        return base | mounting | zeros

    @property
    def _axes(self) -> int:
        return 3 if self.config.reads == "component" else 2

    @property
    def largest(self) -> float:
        """Largest reading of an axis, rad or 1."""
        if self.config.range is not None:
            return self.config.range
        return {"elevation": float(_STEEPEST), "projection": np.pi, "component": 1.0}[self.config.reads]

    def placed(self, model: RobotModel, _target: str) -> RobotModel:
        """Robot with the vertical as a station."""
        turn = turn_to_z(-model.gravity / np.linalg.norm(model.gravity))
        values = zip(STATION[3:], turn.tolist(), strict=True)
        placed = model.with_stations((VERTICAL,))
        return placed.with_values({f"station.{VERTICAL}.{key}": value for key, value in values})

    def _poses(self, q: np.ndarray) -> PoseSet:
        """Pose set of level readings at `q` (N, n)."""
        rows = len(q)
        tilt = np.full((rows, 3), np.nan)
        tilt[:, : self._axes] = 0.0
        return replace(
            PoseSet.unmeasured(q, self.name, VERTICAL, 1.0),
            orientation_sigma=np.full(rows, _STD if self.config.std is None else self.config.std),
            kind=np.full(rows, DIRECTION),
            tilt=tilt,
        )

    def reached(self, model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
        """Configurations (M, n) of `q` (N, n) at which the sensor is in its range."""
        at = predict_measurements(self.placed(model, target), self._poses(q), elastic=False)
        return q[(np.abs(at.residual[len(q) :]) <= self.largest).all(axis=1)]

    def rows(self, placed: RobotModel, q: np.ndarray, _target: str, names: tuple[str, ...]) -> np.ndarray:
        """Rows (N, axes, p) of the readings at `q` (N, n) in the parameters `names`, in standard deviations of a reading."""
        at = predict_measurements(placed, self._poses(q), elastic=False, jacobians=True)
        own = slice(len(q), None)
        white = (
            at.jacobian(names)[own] / np.where(at.readings.present, at.readings.sigma, np.inf)[own, :, None]
        )
        return white[:, : self._axes]
