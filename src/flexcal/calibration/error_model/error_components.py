"""Covariance of the errors of measured points besides the fitted parameters: instrument, robot and model error."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.error_model.groups import ErrorGroups, occurrence
from flexcal.calibration.error_model.incidence_matrices import incidence
from flexcal.calibration.error_model.whitening import Whitening
from flexcal.calibration.measurement import (
    METRES,
    OF_INSTRUMENTS,
    RADIANS,
    ROBOT,
    PredictedMeasurements,
    Readings,
)
from flexcal.model.robot import RobotModel

_SMALLEST = 1e-6
"""Lower bound (m) of the standard deviation of an instrument, for simulated points without noise."""
_SMALLEST_TURN = 1e-7
"""Angle (rad) relative to which a change of a joint error is judged."""


@dataclass(frozen=True)
class ErrorComponents:
    """Standard deviations (1σ, per coordinate) of the error components of measured points.

    `share`: the instrument's noise over the stated sigma, 0 where none is stated (the robot's then contains it); `robot` m, independent
    from measurement to measurement, `pose` m and `angular` rad at every revolute joint, common to the points of one visit to a pose:
    repeatability, of which `joints` are ratios of each revolute joint's to `angular`, their root mean square, empty where all are alike;
    `orientation` rad, independent from measured orientation to orientation, the instrument's where none is stated;
    `workspace`, `order` and `command` m: model error common to a cell of the workspace, to a stretch of the measuring
    order, and to all visits of one command; `transmission` rad, of a wave of order 1 of a joint's transmission error (`waves`). `views`,
    `sockets`, `lengths` and `contacts` m, in place of `robot`: of the readings of cameras, of balls in sockets, of wires and of touched
    faces, where measurements of another kind have that.
    """

    share: float
    robot: float = 0.0
    pose: float = 0.0
    angular: float = 0.0
    workspace: float = 0.0
    order: float = 0.0
    command: float = 0.0
    transmission: float = 0.0
    orientation: float = 0.0
    views: float = 0.0
    sockets: float = 0.0
    lengths: float = 0.0
    contacts: float = 0.0
    joints: tuple[float, ...] = ()

    @property
    def model(self) -> float:
        """Standard deviation of the model error per coordinate, m."""
        return float(np.sqrt(self.workspace**2 + self.order**2 + self.command**2))

    def settled(self, before: ErrorComponents, tolerance: float) -> bool:
        """Whether every component has converged to a share `tolerance` of the whole."""
        own, other = (np.array([s.robot, s.pose, s.workspace, s.order, s.command]) for s in (self, before))
        same = np.abs(own - other).max() <= tolerance * (np.linalg.norm(own) + _SMALLEST)
        angles = (
            (self.angular, before.angular),
            (self.transmission, before.transmission),
            (self.orientation, before.orientation),
            *((getattr(self, name), getattr(before, name)) for name in OF_INSTRUMENTS),
        )
        if len(self.joints) == len(before.joints):
            angles += tuple(zip(self.turning, before.turning, strict=True))
        turned = all(abs(a - b) <= tolerance * (a + _SMALLEST_TURN) for a, b in angles)
        return bool(same) and turned and abs(self.share - before.share) <= tolerance

    @property
    def turning(self) -> tuple[float, ...]:
        """Repeatability of each revolute joint, rad; empty where all are alike."""
        return tuple(self.angular * ratio for ratio in self.joints)

    def by_joints(self, turns: np.ndarray) -> np.ndarray:
        """Columns (R, 3, r), m or rad, of the repeatability of the joints, from how they move the readings, `turns` (R, 3, r), per rad."""
        return turns * (np.array(self.turning) if self.joints else self.angular)

    def independent(self, readings: Readings, turns: np.ndarray) -> np.ndarray:
        """Covariance (R, 3, 3), m² or rad², of instrument and repeatability at each of the `readings`.

        `turns` (R, 3, r) is how the revolute joints move the readings, per rad.
        """
        diagonal = self._scattered(readings) + self.pose**2 * (readings.unit == METRES)
        own = self.share**2 * readings.blocks + diagonal[:, :, None] * np.eye(3)
        moved = self.by_joints(turns)
        return own + moved @ np.swapaxes(moved, 1, 2)

    def _scattered(self, readings: Readings) -> np.ndarray:
        """Variances (R, 3) of what is independent from reading to reading besides what is stated; 1 where there is no reading."""
        own = sum(
            getattr(self, name) ** 2 * readings.of_scatter(name) for name in (ROBOT, *readings.instruments)
        )
        turned = self.orientation**2 * (readings.unit == RADIANS)
        return own + turned + np.where(readings.present, _SMALLEST**2, 1.0)

    def jointly(self, readings: Readings, turns: np.ndarray, cells: ErrorGroups) -> np.ndarray:
        """Joint covariance (G, 3 T, 3 T) of all readings of a visit to a pose, independent of other visits.

        The diagonal is 1 where a visit lacks a reading.
        """
        diagonal = cells.gathered(self._scattered(readings))
        stated = self.share**2 * stated_covariance(readings, cells)
        if stated.ndim == 2:
            diagonal = diagonal + stated
        single = np.where(diagonal > 0, diagonal, 1.0)[:, :, None] * np.eye(diagonal.shape[1])
        if stated.ndim == 3:
            single += stated
        common = cells.gathered(self.common(readings, turns))
        return single + common @ np.swapaxes(common, 1, 2)

    def common(self, readings: Readings, turns: np.ndarray) -> np.ndarray:
        """Columns (R, 3, 3 + r) of the repeatability shared by the readings of a visit, each times a standard normal variable."""
        return np.concatenate([self.pose * translations(readings), self.by_joints(turns)], axis=2)

    def whitening(self, readings: Readings, turns: np.ndarray) -> Whitening:
        """Whitening by the total variance of single readings, and what is stated of a point with its orientation."""
        whole = self.independent(readings, turns)
        whole = whole + self.systematic(readings)[:, :, None] * np.eye(3)
        across = None if readings.across is None else self.share**2 * readings.across
        return Whitening.of(whole, across, readings.beside)

    def systematic(self, readings: Readings) -> np.ndarray:
        """Variances (R, 3) of the model error, of which sockets, lengths and contacts beside points have none of the workspace."""
        lengths = readings.unit == METRES
        placed = readings.of_scatter(ROBOT) | readings.of_scatter("views")
        return (self.order**2 + self.command**2) * lengths + self.workspace**2 * placed

    def weights(self, readings: Readings, turns: np.ndarray) -> Whitening:
        """Whitening with the repeatability of the joints averaged over readings and directions.

        What is taken for it may be an error of the model, and weights that follow it would fit the points of short levers only.
        """
        own = turns[~readings.points]
        turned = float(np.mean((self.by_joints(own) ** 2).sum(axis=2))) if own.size else 0.0
        orientation = float(np.hypot(self.orientation, np.sqrt(turned)))
        moved = turns[readings.unit == METRES]
        even = {name: self.evenly(moved, name) for name in (ROBOT, *readings.instruments)}
        return replace(self, pose=0.0, angular=0.0, orientation=orientation, **even).whitening(
            readings, turns
        )

    def evenly(self, turns: np.ndarray, name: str = ROBOT) -> float:
        """Standard deviation of coordinates, m, that move by `turns` (K, r), m/rad, due to the robot's repeatability and the component
        `name`, root mean square.
        """
        turned = float(np.mean((self.by_joints(turns) ** 2).sum(axis=1))) if turns.size else 0.0
        return float(np.sqrt(getattr(self, name) ** 2 + self.pose**2 + turned))

    def shared(self, cells: ErrorGroups, rows: np.ndarray) -> np.ndarray:
        """Sums (k, m) of `rows` (N, 3, m) over the points that share each coordinate of a model error, times its standard deviation."""
        flat = rows.reshape(len(rows), -1)
        sums = [np.zeros((0, flat.shape[1]))]
        for name, labels in cells.blocks.items():
            if (std := getattr(self, name)) > 0:
                sums.append(
                    std * (incidence(labels, np.arange(len(rows)), (int(labels.max()) + 1, len(rows))) @ flat)
                )
        return np.concatenate(sums).reshape(-1, rows.shape[2])


def translations(readings: Readings) -> np.ndarray:
    """Columns (R, 3, 3) of a displacement of the tool in the coordinates that are in metres."""
    moved = np.eye(3) * (readings.unit == METRES)[:, :, None]
    if readings.slopes is not None:
        moved[readings.points] = readings.slopes
    return moved


def stated_covariance(readings: Readings, cells: ErrorGroups) -> np.ndarray:
    """Stated covariance (G, 3 T, 3 T) of the readings of every visit, or its diagonal (G, 3 T) where it is diagonal."""
    if readings.stated is None or readings.across is None:
        return cells.gathered(readings.sigma**2)
    visits, places = cells.visits.shape
    visit, place = cells.pose, occurrence(cells.pose)
    blocks = np.zeros((visits, places, 3, places, 3))
    blocks[visit, place, :, place] = readings.stated
    turned, beside = np.flatnonzero(~readings.points), readings.beside
    blocks[visit[turned], place[turned], :, place[beside]] = readings.across
    blocks[visit[turned], place[beside], :, place[turned]] = np.swapaxes(readings.across, 1, 2)
    return blocks.reshape(visits, 3 * places, 3 * places)


def known_scatter(model: RobotModel, *, stated: bool) -> ErrorComponents | None:
    """Calibrated error components of a robot; without a calibration the instrument alone, with its sigma if `stated`.

    A sigma that the calibration did not have is not added: the robot's part there holds the instrument's. None where nothing is known.
    """
    instrument, share, robot, angular, _, pose, _, _ = model.scatter.std
    if not model.scatter.std.any():
        return ErrorComponents(share=1.0, robot=0.0) if stated else None
    if not stated:
        share = 1.0 if instrument > 0 else 0.0
    alone = np.sqrt(max(robot**2 - pose**2, 0.0))
    return ErrorComponents(
        share=float(share),
        robot=float(alone),
        pose=float(pose),
        angular=float(angular),
        joints=tuple((angular_scatter(model) / angular).tolist()) if model.scatter.joints.any() else (),
    )


def angular_scatter(model: RobotModel) -> np.ndarray:
    """Calibrated repeatability (r,), rad, of the revolute joints with motors."""
    own = [i for i in model.motors if model.joints[i].kind == "revolute"]
    return model.scatter.turns(model.value("scatter.angular"))[own]


def joint_scatter(model: RobotModel) -> list[str]:
    """Names of the repeatability of each of these joints."""
    return [f"scatter.{joint.name}.angular" for joint in model.motor_joints if joint.kind == "revolute"]


def joint_rotation_jacobian(at: PredictedMeasurements) -> np.ndarray:
    """Derivative (R, 3, r) of the readings with respect to a rotation of every revolute motor joint, per rad, in the instrument's frame."""
    joints = [joint for joint in at.model.motor_joints if joint.kind == "revolute"]
    return at.jacobian([f"{joint.name}.offset" for joint in joints])
