"""A kind of measurement, as the fit of all kinds together takes it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.kinds.rigid_motions import registered, rigid_motion
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameters
from flexcal.model.parts import left_jacobian
from flexcal.model.robot import STATION, RobotModel

if TYPE_CHECKING:
    from flexcal.calibration.measurement import PredictedMeasurements


class Kind(ABC):
    """Kind of measurement: its readings, its own parameters, and the place of its station.

    Arm, deflection and station are common to all kinds; without more said, a kind reads the target's coordinates in the station's axes.
    """

    @abstractmethod
    def rows(self, poses: PoseSet) -> np.ndarray:
        """Rows (N,) of a pose set that are of this kind."""

    def read(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """Readings (K, 3), m, of targets `located` (K, 3), m, in the axes of their `station` (K,); zero where a coordinate is not read."""
        return located

    def slopes(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """Change (K, 3, 3) of the readings with a displacement of the target in the station's axes."""
        return np.broadcast_to(np.eye(3), (len(located), 3, 3))

    def angles(self, at: PredictedMeasurements) -> np.ndarray:
        """Measured minus predicted angles (K, 3), rad, of the rows whose orientation is read; only of kinds that do."""
        raise NotImplementedError

    def angle_slopes(self, at: PredictedMeasurements) -> np.ndarray:
        """Change (K, 3, 3) of the read angles with a rotation of the target about the station's axes, rad; only of kinds that read some."""
        raise NotImplementedError

    def scales(self, poses: PoseSet) -> dict[str, np.ndarray]:
        """Parameters that are relative deviations of the true lengths from the readings, with the rows (N,) that each changes.

        Readings are predicted in the instrument's own lengths: if robot and instrument are larger by one factor, no residual changes.
        """
        return {}

    def scale_std(self, model: RobotModel, name: str) -> float | None:
        """Declared standard deviation of one of the `scales`; None for another parameter, and where none is declared."""
        return None

    def shift(self, at: PredictedMeasurements) -> np.ndarray | None:
        """Change (R, 3) of what was measured with parameters of the instrument; None where nothing changes."""
        return None

    def uncertain(self, model: RobotModel, poses: PoseSet) -> tuple[Parameters, np.ndarray]:
        """Parameters of the instruments about which something is known beforehand, and its covariance (p, p); the fit estimates them."""
        return Parameters(), np.zeros((0, 0))

    def owns(self, name: str) -> bool:
        """Whether a parameter belongs to this kind alone."""
        return False

    def column(self, at: PredictedMeasurements, name: str) -> np.ndarray:
        """Derivative (R, 3) of the readings by a parameter that `owns` names."""
        column, rows = np.zeros((len(at.readings.row), 3)), self.scales(at.poses).get(name)
        if rows is not None:
            column[: len(at.poses)] = -np.where(rows[:, None], at.position / (1 + at.model.value(name)), 0.0)
        return column

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """Numbers x, y, z, rx, ry, rz, and `zero` where it has one, of a station that reads `readings` (K, 3) of `targets` (K, 3), m, in
        the base frame.

        Raises `FlexcalError` for too few or badly distributed targets, and where the readings fit no place.
        """
        return registered(station, targets, readings, rigid_motion)

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """Numbers of a station's pose that the readings tell; its rotation only where that is free (`turned`)."""
        return STATION if turned else STATION[:3]

    def target_start(self, at: PredictedMeasurements, target: str) -> dict[str, float]:
        """Numbers of how a target's axes are on the robot by their keys, from predictions `at` with them as declared; only of kinds that
        read angles.
        """
        return {}

    def target_parameters(self, poses: PoseSet, target: str) -> Sequence[str]:
        """Keys of the numbers of a target that these readings tell beyond its place; only of kinds that read angles."""
        return ()

    def tells_lengths(self, poses: PoseSet) -> bool:
        """Whether any reading tells how large the robot is."""
        return bool(self.rows(poses).any())


def tilts_across(model: RobotModel, station: str, axis: np.ndarray) -> list[str]:
    """Two coordinates of a station's rotation vector, without the one that is most like a rotation about an `axis` (3,)."""
    about = np.linalg.solve(left_jacobian(model.stations.pose[model.station_index(station), 3:]), axis)
    return [key for k, key in enumerate(STATION[3:]) if k != int(np.argmax(np.abs(about)))]
