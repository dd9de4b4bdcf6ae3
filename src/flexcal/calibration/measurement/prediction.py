"""Predicted measurements at each pose, and their derivatives by all parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.calibration.kinds import ANGULAR, KINDS, LOCATING, Kind
from flexcal.calibration.measurement.arm_columns import ArmColumns, as_slice
from flexcal.calibration.measurement.readings import Readings
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import (
    PointKinematics,
    carrier_ends,
    carrier_kinematics,
    depends_on_temperature,
    expanded,
    relative_kinematics,
    temperature_rise,
)
from flexcal.model.parts import left_jacobian, vector_rotation
from flexcal.model.robot import STATION, RobotModel
from flexcal.model.statics import (
    Equilibrium,
    carried_mass,
    force_moments,
    lateral_axes,
    lateral_slopes,
    tool_at_rest,
)
from flexcal.progress import Progress, silent


def require_points(poses: PoseSet, where: str = "the poses") -> None:
    """Raise `FlexcalError` for measurements that are not of whole points; `where` names the files."""
    if poses.kind is not None and (poses.kind != "").any():
        raise FlexcalError(
            "E-CAL-011",
            f"{where}: distances, touches and inclinations alone do not tell where a point is; give points x, y, z, or compare by "
            "'flexcal calibrate --hold-out COLUMN'.",
        )


_BLOCK = 20_000
"""Number of poses whose predictions are in memory together."""


@dataclass(frozen=True, eq=False)
class PredictedMeasurements:
    """Predicted points at the poses, with the data for their derivatives and for all R `readings`.

    `located` (N, 3), m, are the targets in the instruments' frames, `position` (N, 3) what the instruments read of them: the same where
    they measure coordinates. `kinematics` are the targets in the base frame, or in that of the robot's link which carries the instrument:
    then `carrier` is that frame in the base frame, and `target` the targets there.
    """

    model: RobotModel
    poses: PoseSet
    located: np.ndarray
    position: np.ndarray
    base: np.ndarray
    rest: Equilibrium
    kinematics: PointKinematics
    target: PointKinematics
    carrier: PointKinematics | None

    @cached_property
    def readings(self) -> Readings:
        """What was measured at the poses."""
        return Readings.of(self.poses, _slopes(self.model, self.poses, self.located))

    @cached_property
    def residual(self) -> np.ndarray:
        """Measured minus predicted (R, 3): points, m, and the rotation vector from predicted to measured axes, rad, both in the
        instrument's frame.
        """
        angles = np.zeros((self.readings.turns, 3))
        for kind, own in self._angular:
            angles[own] = kind.angles(self)
        residual = np.concatenate([self.poses.position - self.position, angles])
        for kind in KINDS:
            shift = kind.shift(self)
            if shift is not None:
                residual += shift
        return residual

    @cached_property
    def _known(self) -> dict[tuple[str, ...], np.ndarray]:
        """The columns of `jacobian` that were computed last, by their names."""
        return {}

    @cached_property
    def _stations(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        return {}

    @property
    def _angular(self) -> list[tuple[Kind, np.ndarray]]:
        """Kinds that read angles at the poses, with a mask (M,) of those that each reads."""
        turned = self.poses.angled
        rows = [(kind, kind.rows(self.poses)[turned]) for kind in ANGULAR]
        return [(kind, own) for kind, own in rows if own.any()]

    @cached_property
    def orientation(self) -> np.ndarray:
        """Predicted axes (M, 3, 3) of the targets whose orientation was measured, in the instrument's frame."""
        own = self.poses.angled
        axes = np.matmul(self.base[own], self.kinematics.orientation[own])
        for name in dict.fromkeys(self.poses.target[own].tolist()):
            rows = self.poses.target[own] == name
            axes[rows] = axes[rows] @ vector_rotation(self.turn_of(name))
        return axes

    def turn_of(self, target: str) -> np.ndarray:
        """Rotation vector (3,), rad, from a point's frame to the axes of the target there."""
        return self.model.geometry.point_turn[list(self.model.points).index(target)]

    @cached_property
    def angle_slopes(self) -> np.ndarray:
        """Change (M, 3, 3) of the read angles with a rotation of the target about the instrument's axes."""
        slopes = np.zeros((self.readings.turns, 3, 3))
        for kind, own in self._angular:
            slopes[own] = kind.angle_slopes(self)
        return slopes

    def displaced(self, moved: np.ndarray) -> np.ndarray:
        """Change (N, 3, …) of what the instruments read with displacements of the targets (N, 3, …) in their axes."""
        slopes = self.readings.slopes
        return (
            moved
            if slopes is None
            else np.matmul(slopes, moved.reshape(len(moved), 3, -1)).reshape(moved.shape)
        )

    def moved(self, columns: np.ndarray) -> np.ndarray:
        """Readings (R, 3, k) from motions of the targets, `columns` (N, 6, k) in the base frame."""
        moved = self.displaced(np.matmul(self.base, columns[:, :3]))
        if not self.readings.turns:
            return moved
        own = self.poses.angled
        return np.concatenate([moved, np.matmul(self.angle_slopes @ self.base[own], columns[own, 3:])])

    def by_row(self, values: np.ndarray) -> np.ndarray:
        """Values (N, …) of the poses at each reading, (R, …)."""
        return values if not self.readings.turns else values[self.readings.row]

    def jacobian(self, names: Sequence[str]) -> np.ndarray:
        """∂reading/∂parameter (R, 3, len(names)) in natural units, the motion of the deflection included.

        Read-only, as it is kept for other calls with some of these names. Raises `FlexcalError` for a name without effect on the readings.
        """
        names = tuple(names)
        for others, columns in self._known.items():
            places = {name: k for k, name in enumerate(others)}
            if names == others:
                return columns
            if places.keys() >= set(names):
                return columns.take([places[name] for name in names], axis=2)
        self._known.clear()
        self._known[names] = self._columns(names)
        return self._known[names]

    def _columns(self, names: Sequence[str]) -> np.ndarray:
        result = np.zeros((len(self.readings.row), 3, len(names)))
        joints, of_arm = self.model.joint_names, list[int]()
        for k, name in enumerate(names):
            owner, _, key = name.rpartition(".")
            if owner.startswith("station.") and key in STATION:
                rows, columns = self._by_station(owner.removeprefix("station."))
                result[rows, :, k] = columns[:, :, STATION.index(key)]
                continue
            kind = None if owner in joints else next((kind for kind in KINDS if kind.owns(name)), None)
            if kind is None:
                of_arm.append(k)
            else:
                result[:, :, k] = kind.column(self, name)
        if of_arm:
            result[:, :, as_slice(of_arm)] = ArmColumns(self).columns([names[k] for k in of_arm])
        result.setflags(write=False)
        return result

    @cached_property
    def lateral(self) -> np.ndarray:
        """Tilt about the bearing's x and y (N, n, axis, 2) of every joint by its lateral compliances, rad per rad/(N m)."""
        model, poses = self.model, self.poses
        masses = carried_mass(model, poses.payload, len(poses))
        slopes = lateral_slopes(model, poses.q, masses)
        if poses.force is not None:
            axes = lateral_axes(model, poses.q)
            moments = force_moments(self.kinematics, poses.force)[:, :, :2]
            slopes = slopes + np.matmul(axes, moments[:, :, :, None]) * axes
        return slopes

    def _by_station(self, station: str) -> tuple[np.ndarray, np.ndarray]:
        """Readings (K,) from a station, and their derivatives (K, 3, 6) by the numbers of its pose."""
        if station not in self._stations:
            own, turned = self.poses.station == station, self.poses.angled
            rows, slopes = np.flatnonzero(own), self.readings.slopes
            pose = self.model.stations.pose[self.model.station_index(station)]
            axes = left_jacobian(pose[3:])
            moved = np.empty((len(rows), 3, 6))
            moved[:, :, :3] = np.eye(3)
            moved[:, :, 3:] = np.cross(axes.T, (self.located[rows] - pose[:3])[:, None]).swapaxes(1, 2)
            moved = moved if slopes is None else np.matmul(slopes[rows], moved)
            if own[turned].any():
                turns = np.zeros((int(own[turned].sum()), 3, 6))
                turns[:, :, 3:] = self.angle_slopes[own[turned]] @ axes
                rows = np.concatenate([rows, len(own) + np.flatnonzero(own[turned])])
                moved = np.concatenate([moved, turns])
            self._stations[station] = rows, moved
        return self._stations[station]


def _read(model: RobotModel, poses: PoseSet, located: np.ndarray) -> np.ndarray:
    """Readings (N, 3), m, of targets at `located` (N, 3), m, in their stations' axes; zero where a coordinate is not measured."""
    readings = located
    if poses.kind is not None:
        readings = np.where(poses.present, located, 0.0)
        for kind in LOCATING:
            own = kind.rows(poses)
            readings[own] = kind.read(model, poses.station[own], located[own])
    stretch = _stretch(model, poses)
    return readings if stretch is None else readings / stretch[:, None]


def _stretch(model: RobotModel, poses: PoseSet) -> np.ndarray | None:
    """True lengths over those of the readings (N,); None where all are true."""
    deviation = np.zeros(len(poses))
    for kind in LOCATING:
        for name, rows in kind.scales(poses).items():
            deviation[rows] = model.value(name)
    return 1 + deviation if deviation.any() else None


def _slopes(model: RobotModel, poses: PoseSet, located: np.ndarray) -> np.ndarray | None:
    """Change (N, 3, 3) of the readings with a displacement of the target; None where all read coordinates."""
    stretch = _stretch(model, poses)
    if poses.kind is None:
        return None if stretch is None else np.eye(3) / stretch[:, None, None]
    slopes = np.zeros((len(poses), 3, 3))
    for kind in LOCATING:
        own = kind.rows(poses)
        slopes[own] = kind.slopes(model, poses.station[own], located[own])
    return slopes if stretch is None else slopes / stretch[:, None, None]


def predict_measurements(
    model: RobotModel,
    poses: PoseSet,
    *,
    flank: np.ndarray | None = None,
    elastic: bool = True,
    jacobians: bool = False,
) -> PredictedMeasurements:
    """Predicted positions of the target of every pose in the instrument's frame, for the deflected, calibrated robot.

    `flank` (N, n) fixes the side of the backlash; without, the drive torque at rest decides. Without `elastic` the arm is rigid.
    Raises `FlexcalError` for unknown targets and stations, and payloads without a declaration.
    """
    tool = tool_at_rest(
        model,
        poses.q,
        poses.payload,
        poses.target,
        flank=flank,
        elastic=elastic,
        jacobians=jacobians,
        force=poses.force,
        temperature=poses.temperature,
        approach=poses.approach,
    )
    if not np.isfinite(tool.kinematics.position).all():
        pose = poses.pose[int(np.argmin(np.isfinite(tool.kinematics.position).all(axis=1)))]
        raise FlexcalError(
            "E-CAL-030",
            f"a loop of {model.name} does not close at pose {pose} with its present geometry; correct `loops:`, or leave the pose out.",
        )
    carrier = carrier_kinematics(model, poses.q, tool.rest.deflection, poses.station, jacobians=jacobians)
    rise = None
    if poses.temperature is not None and depends_on_temperature(model):
        rise = temperature_rise(model, poses.temperature)
    if carrier is not None and rise is not None:
        carrier = expanded(model, poses.q, carrier, poses.station, carrier_ends(model), rise)
    seen = tool.kinematics if carrier is None else relative_kinematics(tool.kinematics, carrier)
    at, base = np.empty((len(poses), 3)), np.empty((len(poses), 3, 3))
    for name in poses.stations:
        own, place = poses.station == name, model.stations.pose[model.station_index(name)]
        at[own], base[own] = place[:3], vector_rotation(place[3:])
        if rise is not None:
            at[own] += np.outer(rise[own], model.stations.drift[model.station_index(name)])
    located = np.matmul(base, seen.position[:, :, None])[:, :, 0] + at
    position = _read(model, poses, located)
    return PredictedMeasurements(
        model, poses, located, position, base, tool.rest, seen, tool.kinematics, carrier
    )


def predicted_positions(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True, progress: Progress = silent
) -> np.ndarray:
    """Positions (N, 3) of `predict_measurements`, m, for any number of poses, block by block."""
    parts = [np.zeros((0, 3))]
    for first in range(0, len(poses), _BLOCK):
        progress("all points", first / len(poses))
        parts.append(
            predict_measurements(model, poses.subset(slice(first, first + _BLOCK)), elastic=elastic).position
        )
    progress("all points", 1.0)
    return np.concatenate(parts)
