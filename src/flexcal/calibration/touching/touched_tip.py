"""Place of a tool's tip in its frame, from touches of fixed points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.touching.arm_errors import ArmErrors, arm_errors, touched_frames
from flexcal.calibration.touching.touch_fit import TouchFit, residual_rms, without
from flexcal.data.poses import Touches
from flexcal.errors import FlexcalError
from flexcal.estimation import consistent_groups, fit_two_variances
from flexcal.model.robot import Posterior, RobotModel
from flexcal.units import DEGREE

LEAST_TOUCHES = 3
_LEAST_TURN = 0.5 * DEGREE
"""Root-mean-square rotation of the frame about its mean orientation from which the tip counts as determined, rad."""


@dataclass(frozen=True, eq=False)
class TipFit(TouchFit):
    """The tip `xyz` (3,), m, in its frame, and the fixed points that it touched, whose positions in the base frame follow in the `fit`.

    `errors` are in the base frame.

    Attributes
    ----------
    points : tuple of str
        Names of the fixed points.
    turn : float
        Root-mean-square rotation of the frame about the axis about which it turned least, rad.
    flange : ndarray
        Covariance (3, 3), m², of the place of the real flange in that of the calibrated robot, which the calibration did not see.
    """

    points: tuple[str, ...]
    turn: float
    flange: np.ndarray

    @property
    def xyz(self) -> np.ndarray:
        """The tip (3,) in its frame, m."""
        return self.fit.values[:3]


def fit_tip(model: RobotModel, touches: Touches, point: str, unseen: Posterior | None = None) -> TipFit:
    """Fit the tip t and the fixed points c to p + R t = c, for poses p, R of the frame of the point `point` of the model, whose `xyz` is 0.

    Linear least squares (the sphere fit of tool calibration by touching one point), with the errors of the arm as correlated errors.
    `unseen` is the part of the posterior that a calibration did not see: its errors move the flange, and count for the frame alone.
    Raises `FlexcalError` for too few touches, and for rotations that do not determine the tip, with the missing motion.
    """
    points = tuple(sorted(set(touches.touched.tolist())))
    _require_enough(touches, points)
    frames = touched_frames(model, touches, point)
    design = _design(frames.rotation, touches.touched, points)
    observed = -frames.position.ravel()
    numbers = np.array([points.index(name) for name in touches.touched.tolist()])
    _require_turns(frames.rotation, numbers, "")
    groups = np.repeat(np.arange(len(touches)), 3)
    xyz = np.linalg.lstsq(design, observed, rcond=None)[0][:3]
    hidden = None if unseen is None else replace(model, posterior=unseen)
    if unseen is not None:
        seen = replace(model.posterior, covariance=model.posterior.covariance - unseen.covariance)
        model = replace(model, posterior=seen)
    arm = _errors_at(model, touches, point, xyz, gauge=unseen is None)
    kept = consistent_groups(design, observed, arm.covariance, arm.sizes, groups, numbers)
    turn = _require_turns(frames.rotation[kept], numbers[kept], without(touches, kept))
    rows = kept[groups]
    block = np.ix_(rows, rows)
    first = fit_two_variances(design[rows], observed[rows], arm.covariance[block], arm.sizes)
    arm = _errors_at(model, touches, point, first.values[:3], gauge=unseen is None)
    fit = fit_two_variances(design[rows], observed[rows], arm.covariance[block], arm.sizes)
    errors = (design @ fit.values - observed).reshape(-1, 3)
    arm_rms = fit.size * residual_rms(design[rows], arm.covariance[block], int(kept.sum()))
    flange = np.zeros((3, 3))
    if hidden is not None:
        moved = _errors_at(hidden, touches, point, fit.values[:3], gauge=False, scatter=False)
        pull = np.linalg.pinv(design[rows])[:3]
        flange = pull @ moved.covariance[block] @ pull.T
    return TipFit(fit, errors, kept, arm, arm_rms, points, turn, flange)


def _design(rotation: np.ndarray, touched: np.ndarray, points: tuple[str, ...]) -> np.ndarray:
    design = np.zeros((len(rotation), 3, 3 + 3 * len(points)))
    design[:, :, :3] = rotation
    for k, name in enumerate(points):
        design[touched == name, :, 3 + 3 * k : 6 + 3 * k] = -np.eye(3)
    return design.reshape(3 * len(rotation), -1)


def _errors_at(
    model: RobotModel, touches: Touches, point: str, xyz: np.ndarray, *, gauge: bool, scatter: bool = True
) -> ArmErrors:
    values = {f"point.{point}.{axis}": float(value) for axis, value in zip("xyz", xyz, strict=True)}
    return arm_errors(
        touched_frames(model.with_values(values), touches, point), tool=False, gauge=gauge, scatter=scatter
    )


def _require_enough(touches: Touches, points: tuple[str, ...]) -> None:
    for name in points:
        rows = np.flatnonzero(touches.touched == name)
        if len(rows) == 1 and len(points) > 1:
            raise FlexcalError(
                "E-TOOL-006",
                f"{touches.label(int(rows[0]))}: the point '{name}' is touched only once, which tells nothing of the tip; touch it in "
                "other orientations too, or correct its name.",
            )
    if len(touches) < LEAST_TOUCHES:
        raise FlexcalError(
            "E-TOOL-007",
            f"there are {len(touches)} touches; at least {LEAST_TOUCHES} are needed, four or more in orientations about 30° to 90° apart "
            "show wrong ones too.",
        )


def _require_turns(rotation: np.ndarray, numbers: np.ndarray, without: str) -> float:
    """Root-mean-square rotation (rad) about the axis about which the frames of one fixed point turn least.

    A direction of the frame that all rotations leave where it is has an eigenvalue of zero: along it the tip is unknown.
    """
    moved = np.concatenate(
        [rotation[numbers == k] - rotation[numbers == k].mean(axis=0) for k in np.unique(numbers)]
    ).reshape(-1, 3)
    sizes, axes = np.linalg.eigh(moved.T @ moved / len(rotation))
    turns = np.sqrt(np.maximum(sizes, 0.0))
    if turns[2] < _LEAST_TURN:
        raise FlexcalError(
            "E-TOOL-008",
            f"the tool has the same orientation in all touches of a point{without}, to {turns[2] / DEGREE:.2g}°, so no direction of the "
            "tip is determined; touch the point again with the tool turned by 30° or more about at least two different axes.",
        )
    if turns[0] < _LEAST_TURN:
        raise FlexcalError(
            "E-TOOL-009",
            f"the tool is turned about one axis only{without}, {_direction(axes[:, 0])} of its frame, so the tip's position along this "
            "axis is not determined; touch the point again with this axis tilted by 30° or more.",
        )
    return float(turns[0])


def _direction(axis: np.ndarray) -> str:
    """A direction in words: an axis of the frame where it lies within 2° of it, else its components."""
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > np.cos(2 * DEGREE):
        return "the " + "xyz"[largest] + " axis"
    signed = axis * np.sign(axis[largest])
    return "the direction (" + ", ".join(f"{value:.2f}" for value in signed) + ")"
