"""Directions: the vertical in the axes of an inclinometer, or of an accelerometer at rest, on any link."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.kinds.kind import Kind, tilts_across
from flexcal.calibration.kinds.robust_start import turn_to_z
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.parts import rotation_vector, skew_matrix, vector_rotation
from flexcal.model.robot import STATION, ZEROS, InclinometerConfig, RobotModel

if TYPE_CHECKING:
    from flexcal.calibration.measurement import PredictedMeasurements

_FOREIGN = np.deg2rad(5)
"""Median misfit, rad, above which readings and robot do not belong together."""
_STEEPEST = 1e-3
"""Least cosine of an elevation for its slope: at the vertical it is infinite."""
_LARGEST_ZERO = 0.3
"""Zero of an axis, rad, that no sensor has: with half a turn, projections of the wrong sign would fit."""
_STEPS, _SMALL = 30, 1e-10
_SPANNED = 1e-3
"""Extent of the vertical's directions in the sensor's frame, relative to the largest, below which they lie in a plane."""
_UNITS = (("degrees", 180 / np.pi), ("mrad or mm/m", 1e3), ("minutes of arc", 60 * 180 / np.pi))


class Directions(Kind):
    """Elevations, projections or components of the vertical along the sensor's axes, each with a zero; the sensor's mounting is free.

    They never tell lengths, places, nor rotations about the vertical. The station is the vertical itself: its z axis is up.
    """

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.tilted

    def read(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.read`: nothing of where the sensor is."""
        return np.zeros_like(located)

    def slopes(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.slopes`."""
        return np.zeros((len(located), 3, 3))

    def angles(self, at: PredictedMeasurements) -> np.ndarray:
        """As `Kind.angles`: readings; zero for axes that the sensor does not have."""
        own, axes = self._own(at)
        assert at.poses.tilt is not None
        left = np.zeros((len(axes), 3))
        for name, rows in _by_sensor(own):
            zero = at.model.geometry.point_zero[list(at.model.points).index(name)]
            sensor = inclinometer(at.model, name)
            read = _reading(sensor, axes[rows, 2]) + zero
            left[rows] = _wrapped(sensor, at.poses.tilt[at.poses.tilted][rows] - read)
        return np.nan_to_num(left)

    def angle_slopes(self, at: PredictedMeasurements) -> np.ndarray:
        """As `Kind.angle_slopes`."""
        own, axes = self._own(at)
        assert at.poses.tilt is not None
        # a rotation d about the station's axes changes the height of axis a by d · (a × z)
        turning = np.cross(axes.swapaxes(1, 2), [0.0, 0.0, 1.0])
        slopes = np.zeros((len(axes), 3, 3))
        for name, rows in _by_sensor(own):
            slopes[rows] = _reading_slopes(inclinometer(at.model, name), axes[rows, 2]) @ turning[rows]
        return np.where(np.isfinite(at.poses.tilt[at.poses.tilted])[:, :, None], slopes, 0.0)

    def owns(self, name: str) -> bool:
        """As `Kind.owns`."""
        return name.startswith("point.") and name.rpartition(".")[2] in ZEROS

    def column(self, at: PredictedMeasurements, name: str) -> np.ndarray:
        """As `Kind.column`."""
        owner, _, key = name.rpartition(".")
        own = at.poses.tilted & (at.poses.target == owner.removeprefix("point."))
        column = np.zeros((len(at.readings.row), 3))
        column[len(at.poses) :, ZEROS.index(key)] = own[at.poses.angled]
        return np.where(at.readings.present, column, 0.0)

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """As `Kind.start`: z is opposite to gravity."""
        turn = turn_to_z(-model.gravity / np.linalg.norm(model.gravity))
        return {
            **dict.fromkeys(STATION[:3], 0.0),
            **dict[str, float](zip(STATION[3:], turn.tolist(), strict=True)),
        }

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """As `Kind.place`: two inclinations of the base, unless it is declared level."""
        if declared_level(model, poses):
            return ()
        return tilts_across(model, station, np.array([0.0, 0.0, 1.0]))

    def target_start(self, at: PredictedMeasurements, target: str) -> dict[str, float]:
        """As `Kind.target_start`: mounting and zeros by Gauss-Newton from all rotations of a cube, the one that fits best.

        Raises `FlexcalError` where no mounting fits, as for readings in degrees, or of which an axis has the wrong sign.
        """
        own, axes = self._own(at)
        assert at.poses.tilt is not None
        rows, sensor = own == target, inclinometer(at.model, target)
        up, tilt = axes[rows, 2], at.poses.tilt[at.poses.tilted][rows]
        turn, zero, misfit = _mounting(sensor, up, tilt)
        if misfit > _FOREIGN:
            raise FlexcalError("E-CAL-031", _cause(target, sensor, up, tilt, misfit))
        values = dict[str, float](zip(STATION[3:], rotation_vector(turn).tolist(), strict=True))
        return {**values, **dict[str, float](zip(ZEROS, zero.tolist(), strict=True))}

    def target_parameters(self, poses: PoseSet, target: str) -> Sequence[str]:
        """As `Kind.target_parameters`: its mounting, and the zeros of its axes."""
        assert poses.tilt is not None
        own = poses.tilt[poses.tilted & (poses.target == target)]
        return (*STATION[3:], *(key for k, key in enumerate(ZEROS) if np.isfinite(own[:, k]).any()))

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`."""
        return False

    def _own(self, at: PredictedMeasurements) -> tuple[np.ndarray, np.ndarray]:
        """Names (K,) of the sensors, and their predicted axes (K, 3, 3), the columns, in the station's."""
        return at.poses.target[at.poses.tilted], at.orientation[at.poses.tilted[at.poses.angled]]


def inclinometer(model: RobotModel, name: str) -> InclinometerConfig:
    """Declaration of an inclinometer."""
    declared = model.config.measurements[name]
    assert isinstance(declared, InclinometerConfig)
    return declared


def is_inclinometer(model: RobotModel, name: str) -> bool:
    """Whether a point is an inclinometer."""
    declared = model.config.measurements.get(name)
    return declared is not None and declared.kind == "inclinometer"


def declared_level(model: RobotModel, poses: PoseSet) -> bool:
    """Whether inclinometers were read and the base is declared level."""
    return any(inclinometer(model, name).level for name in dict.fromkeys(poses.target[poses.tilted].tolist()))


def _by_sensor(names: np.ndarray) -> list[tuple[str, np.ndarray]]:
    return [(name, names == name) for name in dict.fromkeys(names.tolist())]


def _reading(sensor: InclinometerConfig, up: np.ndarray) -> np.ndarray:
    """Readings (K, 3) of the axes for the vertical `up` (K, 3) in them."""
    if sensor.reads == "component":
        return up
    if sensor.reads == "elevation":
        return np.arcsin(np.clip(up, -1.0, 1.0))
    return np.arctan2(up, up[:, 2:])


def _reading_slopes(sensor: InclinometerConfig, up: np.ndarray) -> np.ndarray:
    """Change (K, 3, 3) of the readings with the components of the vertical."""
    if sensor.reads == "component":
        return np.broadcast_to(np.eye(3), (len(up), 3, 3))
    if sensor.reads == "elevation":
        cosine = np.sqrt(np.maximum(1 - up**2, _STEEPEST**2))
        return np.eye(3) / cosine[:, :, None]
    squares = np.maximum(up**2 + up[:, 2:] ** 2, _STEEPEST**2)
    slopes = np.eye(3) * (up[:, 2:] / squares)[:, :, None]
    slopes[:, :, 2] -= up / squares
    return slopes


def _wrapped(sensor: InclinometerConfig, difference: np.ndarray) -> np.ndarray:
    """Differences of readings, those of projections between -π and π."""
    if sensor.reads != "projection":
        return difference
    return (difference + np.pi) % (2 * np.pi) - np.pi


def _mounting(
    sensor: InclinometerConfig, up: np.ndarray, tilt: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Rotation (3, 3) of the sensor in its frame, zeros (3,) and median misfit, rad, for the vertical `up` (K, 3) in the frame."""
    fits = [_refined(sensor, up, tilt, cube) for cube in _cube_rotations()]
    best = min(fits, key=lambda fit: fit[2])
    # of mountings that fit alike, the one nearest to the declared
    alike = [fit for fit in fits if fit[2] <= best[2] * 1.01 + _SMALL]
    return min(alike, key=lambda fit: float(np.linalg.norm(rotation_vector(fit[0]))))


def _refined(
    sensor: InclinometerConfig, up: np.ndarray, tilt: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """As `_mounting`, near a given rotation; the zeros move only where the vertical turns in space about the sensor."""
    there, zero = np.isfinite(tilt), np.zeros(3)
    sizes = np.linalg.svd(up - up.mean(axis=0), compute_uv=False)
    biased = np.eye(3) if sizes[-1] > _SPANNED * sizes[0] else np.zeros((3, 3))
    for _ in range(_STEPS):
        inside = up @ turn
        left = _wrapped(sensor, tilt - _reading(sensor, inside) - zero)[there]
        # the rotation R exp(d) gives exp(-d) u = u + u × d
        by_turn = _reading_slopes(sensor, inside) @ np.array([skew_matrix(u) for u in inside])
        columns = np.concatenate([by_turn, np.broadcast_to(biased, by_turn.shape)], axis=2)[there]
        step = np.linalg.lstsq(columns, left, rcond=1e-6)[0]
        size = float(np.linalg.norm(step[:3]))
        turn = turn @ vector_rotation(step[:3] * min(1.0, 0.5 / max(size, _SMALL)))
        zero = zero + step[3:]
        if size < _SMALL:
            break
    left = _wrapped(sensor, tilt - _reading(sensor, up @ turn) - zero)[there]
    misfit = float(np.median(np.abs(left)))
    return turn, zero, misfit if np.abs(zero).max() < _LARGEST_ZERO else misfit + np.pi


def _cube_rotations() -> list[np.ndarray]:
    signed = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1, -1), repeat=3)
    ]
    return [turn for turn in signed if np.linalg.det(turn) > 0]


def _cause(name: str, sensor: InclinometerConfig, up: np.ndarray, tilt: np.ndarray, misfit: float) -> str:
    """Sentence on readings that fit no mounting, with the change that makes them fit where one is found."""
    there = f"the readings of the inclinometer '{name}' differ from the robot's by {np.rad2deg(misfit):.1f}° (median) however it is mounted"
    for unit, factor in _UNITS:
        if _mounting(sensor, up, tilt / factor)[2] < 0.2 * misfit:
            return f"{there}; they fit as {unit}: give rad, or declare the unit of tilt_x, tilt_y under `signals:`."
    axes = [k for k in range(3) if np.isfinite(tilt[:, k]).any()]
    for k in axes:
        flipped = tilt.copy()
        flipped[:, k] *= -1
        if _mounting(sensor, up, flipped)[2] < 0.2 * misfit:
            return (
                f"{there}; they fit with the sign of tilt_{'xyz'[k]} reversed, or with two axes exchanged: all axes are positive upwards "
                "and form a right-handed frame."
            )
    for reads in ("elevation", "projection", "component"):
        other = InclinometerConfig("inclinometer", sensor.frame, reads=reads)
        if reads != sensor.reads and _mounting(other, up, tilt)[2] < 0.2 * misfit:
            return f"{there}; they fit as `reads: {reads}` under `measurements:`."
    return f"{there}: check the order and units of the joint positions, the frame, and the unit and signs of the tilts."
