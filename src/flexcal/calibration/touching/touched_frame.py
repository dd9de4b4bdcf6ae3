"""Frame of a work object in the base frame, from touches of its points or faces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.touching.arm_errors import ArmErrors, TouchedFrames, arm_errors, touched_frames
from flexcal.calibration.touching.frame_start import frame_start, tip_sides
from flexcal.calibration.touching.point_names import OtherOrder, explain_points
from flexcal.calibration.touching.touch_fit import TouchFit, residual_rms
from flexcal.data.poses import FrameTouches
from flexcal.estimation import (
    TwoVarianceFit,
    consistent_groups,
    core_size,
    least_squares_of_two_variances,
    student_quantile,
)
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel

UNKNOWNS = 6
_ROUNDS = 10
_SMALL_STEP = 1e-9


@dataclass(frozen=True, eq=False)
class SizeOfPoints:
    """How much further apart the points were touched than their coordinates say, relative, with the half width of its 95 % interval."""

    deviation: float
    half_width: float


@dataclass(frozen=True, eq=False)
class FrameFit(TouchFit):
    """The frame of a work object; `fit` has its displacement (m) and its rotation vector (rad), in the axes of the base.

    Attributes
    ----------
    origin : ndarray
        Origin (3,) in the base frame, m.
    rotation : ndarray
        Axes (3, 3) of the work object as columns, in the base frame.
    noise_is_known : bool
        Whether there were more touches than the frame needs, so that the noise of touching is known; the covariance is of the arm's errors
        alone otherwise.
    touching : ndarray
        Standard deviations (3,) of the origin from touching alone, m.
    coordinates : ndarray
        The tip (N, 3) in the work object's frame, m.
    from_tool : bool
        Whether the z axis points to the side from which the tool came.
    size : SizeOfPoints, optional
        Size of the points against the arm.
    other_order : OtherOrder, optional
        Exchanged names of points that fit about as well.
    """

    origin: np.ndarray
    rotation: np.ndarray
    noise_is_known: bool
    touching: np.ndarray
    coordinates: np.ndarray
    from_tool: bool
    size: SizeOfPoints | None
    other_order: OtherOrder | None


def fit_frame(model: RobotModel, given: FrameTouches, point: str, *, tip_radius: float = 0.0) -> FrameFit:
    """Fit the frame o, R of a work object to n · (p − o) = w, for tips p and coordinates w along those axes n of it that a touch tells.

    Ordinary least squares, so that the arm comes closest to the points that it touched; its errors are correlated in the covariance, and
    those of the tip are added, where robot.yaml declares their `std`. `tip_radius`
    (m) is that of a ball at the tip, for faces. Raises `FlexcalError` for touches that define no frame, and for points that are
    exchanged, mirrored or in another unit.
    """
    frames = touched_frames(model, given.touches, point)
    tip, away = frames.position, _away_from_tool(frames)
    first = given.known[:, 2] == 0 if given.method != "points" else np.ones(len(given), dtype=bool)
    outside = away[first].mean(axis=0)
    rotation, origin = frame_start(given, tip, outside)
    known = given.known
    if tip_radius:
        known = known + tip_radius * tip_sides(given, tip, rotation, origin)
    declared = model.config.points.get(point)
    std = None if declared is None else declared.std
    arm = arm_errors(frames, tool=std is None)
    other = None
    if given.method == "points":
        expected = _expected_rms(known, tip, rotation, origin, arm)
        other = explain_points(given.touches.touched, known, tip, expected)
    kept, rotation, origin = _agreeing(known, tip, rotation, origin, arm, given.touches.touched)
    rows = _Rows(known, tip, rotation, origin, kept)
    noise_is_known = len(rows.residual) > UNKNOWNS
    fit = rows.fit(arm, None if noise_is_known else 0.0)
    if std is not None:
        fit = _with_tip(fit, rows, frames.rotation, np.array(std))
    origin = origin + fit.values[:3]
    rotation = vector_rotation(fit.values[3:]) @ rotation
    coordinates = (tip - origin) @ rotation
    return FrameFit(
        fit,
        coordinates - known,
        kept,
        arm,
        fit.size * residual_rms(rows.design, rows.covariance(arm), int(kept.sum())),
        origin,
        rotation,
        noise_is_known,
        rows.touching(fit),
        coordinates,
        bool(rotation[:, 2] @ outside > 0),
        rows.size_of_points(arm) if given.method == "points" else None,
        other,
    )


def _away_from_tool(frames: TouchedFrames) -> np.ndarray:
    """Directions (N, 3) from the tip to the last joint's frame; up, where the tip is in its origin."""
    place = frames.model.point(frames.point)
    lever = place.rotation.T @ place.translation + place.xyz
    if np.linalg.norm(lever) < 1e-3:
        return np.tile([0.0, 0.0, 1.0], (len(frames.position), 1))
    return -frames.rotation @ (lever / np.linalg.norm(lever))


class _Rows:
    """Linearised equations of the touches that were kept, one for every coordinate that they tell."""

    def __init__(
        self, known: np.ndarray, tip: np.ndarray, rotation: np.ndarray, origin: np.ndarray, kept: np.ndarray
    ) -> None:
        touch, axis = np.nonzero(~np.isnan(known) & kept[:, None])
        lever, self.normal = tip[touch] - origin, rotation[:, axis].T
        self.touch, self.known = touch, known[touch, axis]
        self.residual = np.einsum("ki,ki->k", self.normal, lever) - self.known
        self.design = np.concatenate([self.normal, -np.cross(self.normal, lever)], axis=1)
        self.strides = 3 * touch[:, None] + np.arange(3)

    def covariance(self, arm: ArmErrors) -> np.ndarray:
        """Covariance (m, m), m², of the arm's errors of size 1."""
        blocks = arm.covariance[self.strides[:, None, :, None], self.strides[None, :, None, :]]
        return np.einsum("ai,abij,bj->ab", self.normal, blocks, self.normal)

    def fit(self, arm: ArmErrors, noise: float | None) -> TwoVarianceFit:
        return least_squares_of_two_variances(
            self.design, self.residual, self.covariance(arm), arm.sizes, noise
        )

    def touching(self, fit: TwoVarianceFit) -> np.ndarray:
        """Standard deviations (3,) of the origin, m, from the noise alone."""
        return fit.median_noise * np.sqrt(np.diag(np.linalg.inv(self.design.T @ self.design))[:3])

    def size_of_points(self, arm: ArmErrors) -> SizeOfPoints | None:
        design = np.concatenate([self.design, self.known[:, None]], axis=1)
        if len(design) <= UNKNOWNS + 1:
            return None
        fit = least_squares_of_two_variances(design, self.residual, self.covariance(arm), arm.sizes)
        half = student_quantile(0.975, fit.freedom) * np.sqrt(fit.covariance[-1, -1])
        return SizeOfPoints(float(fit.values[-1]), float(half))


def _agreeing(
    known: np.ndarray,
    tip: np.ndarray,
    rotation: np.ndarray,
    origin: np.ndarray,
    arm: ArmErrors,
    touched: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which touches (N,) agree with each other, and the rotation and origin that they give by least squares."""
    every = np.ones(len(known), dtype=bool)
    kept = every
    for _ in range(_ROUNDS):
        rotation, origin = _least_squares(known, tip, rotation, origin, kept)
        before, kept = kept, _consistent(_Rows(known, tip, rotation, origin, every), arm, known, touched)
        if (kept == before).all():
            break
    return kept, *_least_squares(known, tip, rotation, origin, kept)


def _consistent(rows: _Rows, arm: ArmErrors, known: np.ndarray, touched: np.ndarray) -> np.ndarray:
    strata = np.zeros(len(known), dtype=int)
    if np.isnan(known).any():
        strata = np.unique(touched, return_inverse=True)[1]
    if _rows_of_core(known, strata) <= UNKNOWNS:
        return np.ones(len(known), dtype=bool)
    return consistent_groups(rows.design, rows.residual, rows.covariance(arm), arm.sizes, rows.touch, strata)


def _rows_of_core(known: np.ndarray, strata: np.ndarray) -> int:
    """Number of equations of the core of `consistent_groups`."""
    told = (~np.isnan(known)).sum(axis=1)
    count = 0
    for number in np.unique(strata):
        own = told[strata == number]
        count += int(own.min()) * core_size(len(own))
    return count


def _least_squares(
    known: np.ndarray, tip: np.ndarray, rotation: np.ndarray, origin: np.ndarray, kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and origin with the least sum of squares, by Gauss-Newton steps."""
    for _ in range(_ROUNDS):
        rows = _Rows(known, tip, rotation, origin, kept)
        step = np.linalg.lstsq(rows.design, rows.residual, rcond=None)[0]
        origin, rotation = origin + step[:3], vector_rotation(step[3:]) @ rotation
        if np.abs(step).max() < _SMALL_STEP:
            break
    return rotation, origin


def _expected_rms(
    known: np.ndarray, tip: np.ndarray, rotation: np.ndarray, origin: np.ndarray, arm: ArmErrors
) -> float:
    rows = _Rows(known, tip, rotation, origin, np.ones(len(known), dtype=bool))
    return residual_rms(rows.design, rows.covariance(arm), len(known))


def _with_tip(fit: TwoVarianceFit, rows: _Rows, rotation: np.ndarray, std: np.ndarray) -> TwoVarianceFit:
    """The fit with the error of the tip's place in its frame, 1σ (3,), m, which all touches have in common."""
    moved = np.einsum("ki,kij->kj", rows.normal, rotation[rows.touch]) * std
    shift = np.linalg.lstsq(rows.design, moved, rcond=None)[0]
    return replace(fit, covariance=fit.covariance + shift @ shift.T)
