"""Errors of measured orientations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.calibration.error_model import joint_rotation_jacobian, known_scatter
from flexcal.calibration.measurement import (
    covariance_root,
    moving_parameters,
    predict_measurements,
    unknown_sides,
    with_target_axes,
)
from flexcal.data.poses import PoseSet
from flexcal.model.robot import LENS, RobotModel
from flexcal.units import DEGREE


@dataclass(frozen=True, eq=False)
class OrientationErrors:
    """Rotation vectors `rotations` (M, 3), rad, from predicted to measured axes of a target.

    `expected` is the root mean square angle, rad, that parameters, robot and instrument are predicted to leave; None where nothing is
    known of it. `placed` are the targets whose axes on the tool were fitted to these same orientations, as one rotation each.
    """

    rotations: np.ndarray
    expected: float | None = None
    placed: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """Block of results.json, in degrees."""
        angle = np.linalg.norm(self.rotations, axis=1) / DEGREE
        return {
            "poses": len(angle),
            "mean_deg": float(angle.mean()),
            "p90_deg": float(np.quantile(angle, 0.9)),
            "max_deg": float(angle.max()),
            "rms_deg": float(np.sqrt(np.mean(angle**2))),
            "expected_rms_deg": None if self.expected is None else self.expected / DEGREE,
            "placed": list(self.placed),
        }


def orientation_errors(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True
) -> OrientationErrors | None:
    """Errors of a calibrated robot at the measured orientations among `poses`, none of which it was fitted to; None without any.

    Axes of a target of which the calibration measured no orientation are placed by these.
    """
    own = poses.subset(poses.turned)
    if not len(own):
        return None
    known = [target for target in own.targets if model.posterior.determines(f"point.{target}.rx")]
    placed = tuple(target for target in own.targets if target not in known)
    standing = model
    for target in placed:
        standing = with_target_axes(standing, own.subset(own.target == target))
    at = predict_measurements(standing, own, elastic=elastic, jacobians=True)
    rotations = at.residual[len(own) :]
    scatter = known_scatter(standing, stated=own.sigma_given)
    if placed or scatter is None:
        return OrientationErrors(rotations, None, placed)
    cameras = [f"camera.{camera}.{key}" for camera in own.lenses for key in LENS]
    names = [
        *moving_parameters(standing, elastic=elastic),
        *(name for name in cameras if name in standing.posterior.parameters),
        *(f"point.{t}.r{axis}" for t in known for axis in "xyz"),
    ]
    roots = np.concatenate([at.jacobian(names) @ covariance_root(standing, names), unknown_sides(at)], axis=2)
    roots = roots[len(own) :]
    scatter = replace(scatter, orientation=standing.value("scatter.orientation"))
    noise = scatter.independent(at.readings, joint_rotation_jacobian(at))[len(own) :]
    squares = (roots**2).sum(axis=(1, 2)) + np.trace(noise, axis1=1, axis2=2)
    return OrientationErrors(rotations, float(np.sqrt(np.mean(squares))))


def orientation_document(
    before: OrientationErrors | None, calibrated: OrientationErrors | None
) -> dict[str, Any] | None:
    """Block `orientation` of results.json; null without measured orientations."""
    if calibrated is None:
        return None
    return {
        "before": None if before is None else before.document(),
        "calibrated": calibrated.document(),
    }


def uncalibrated_orientations(model: RobotModel | None, poses: PoseSet) -> OrientationErrors | None:
    """Errors of the registered, uncalibrated robot at the measured orientations, the targets' axes fitted to them; None without any."""
    own = poses.subset(poses.turned)
    if model is None or not len(own):
        return None
    at = predict_measurements(with_target_axes(model, own), own, elastic=False)
    return OrientationErrors(at.residual[len(own) :], None, own.targets)
