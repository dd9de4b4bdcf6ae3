"""Predicted measurements of a robot whose parameters change."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from flexcal.calibration.measurement import PredictedMeasurements, predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

_ROUNDING = 1e-14
"""Relative difference of parameters due to rounding, as of a logarithm and back."""


@dataclass(frozen=True, eq=False)
class Predictions:
    """Predictions of the robot `start` at the `poses`, `elastic` or rigid; of those with derivatives the last few are kept."""

    start: RobotModel
    poses: PoseSet
    elastic: bool
    _last: deque[tuple[Mapping[str, float], np.ndarray, PredictedMeasurements]] = field(
        default_factory=lambda: deque(maxlen=2)
    )

    def at(self, values: Mapping[str, float], flank: np.ndarray, *, jacobians: bool) -> PredictedMeasurements:
        """Prediction with the given named values on the backlash flanks `flank` (N, n)."""
        for others, side, known in self._last:
            same = others.keys() == values.keys() and np.array_equal(side, flank)
            if same and all(
                math.isclose(others[name], value, rel_tol=_ROUNDING) for name, value in values.items()
            ):
                return known
        robot = self.start.with_values(values)
        found = predict_measurements(
            robot, self.poses, flank=flank, elastic=self.elastic, jacobians=jacobians
        )
        if jacobians:
            self._last.append((values, flank, found))
        return found

    def consistent(self, values: Mapping[str, float], flank: np.ndarray) -> PredictedMeasurements:
        """Prediction on the flanks that the torques at rest decide, with derivatives; `flank` (N, n) are those supposed so far."""
        found = self.at(values, flank, jacobians=True)
        loose = list(self.start.backlash_joints)
        if (np.sign(found.rest.torque[:, loose]) == flank[:, loose]).all():
            return found
        robot = self.start.with_values(values)
        return predict_measurements(robot, self.poses, elastic=self.elastic, jacobians=True)
