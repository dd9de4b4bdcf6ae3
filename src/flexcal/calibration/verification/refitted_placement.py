"""Verification with a refit of the instrument's placement or of the measured point: leave-one-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.calibration.measurement import predict_measurements, require_points, with_stations_at_base
from flexcal.calibration.verification.best_fit_registration import best_placement, rigid_placement
from flexcal.calibration.verification.unseen_poses import (
    ErrorCovariance,
    PredictionErrors,
    prediction_errors_with_covariance,
)
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel

Refit = Literal["station", "point"]
_RANK = 1e-9
_FREE = 1e-6
"""Least remaining redundancy of a pose's coordinates at which it can be left out."""
_STEPS = 10
_SMALL = 1e-10


@dataclass(frozen=True, eq=False)
class RefittedVerification:
    """Verification with the placement of the instrument (`station`), the measured points (`point`), or both fitted to its own poses.

    `result` has errors by leave-one-out: each pose against the placement that the other poses give, so that they are honest for all poses.
    `covariance` is that of these errors; `parameters` how many were fitted; `model` is the robot with
    the placement that all poses give. `probability` is that of a placement as far from the calibrated one where neither was moved, by the
    covariance of the calibration and of the errors at these poses.
    """

    what: tuple[Refit, ...]
    model: RobotModel
    parameters: int
    result: PredictionErrors
    covariance: ErrorCovariance
    probability: float


def verify_refitted(model: RobotModel, poses: PoseSet, what: Sequence[Refit]) -> RefittedVerification:
    """Verify `model` at `poses` with stations or points fitted again, all else as calibrated.

    Linear least squares leaves one pose out by its hat matrix H: e_i = (I - H_ii)⁻¹ r_i. Raises `FlexcalError` where the poses are too
    few for that.
    """
    require_points(poses)
    poses = poses.without_orientations()
    placed = _placed(model, poses, what)
    at = predict_measurements(placed, poses, jacobians=True)
    columns = at.jacobian(_names(poses, what)).reshape(3 * len(poses), -1)
    scale = np.linalg.norm(columns, axis=0)
    left, sizes, _ = np.linalg.svd(columns / np.where(scale > 0, scale, 1.0), full_matrices=False)
    basis = left[:, sizes > _RANK * sizes[0]]
    blocks = basis.reshape(len(poses), 3, -1)
    own = np.eye(3) - blocks @ np.swapaxes(blocks, 1, 2)
    if np.linalg.eigvalsh(own).min() < _FREE:
        raise FlexcalError(
            "E-CAL-019",
            f"{len(poses)} poses are too few to refit {' and '.join(_WORDS[name] for name in what)} and to verify with: "
            f"{basis.shape[1]} of their {3 * len(poses)} coordinates go into that; measure {2 * basis.shape[1] // 3 + 4} or more.",
        )

    def left_out(values: np.ndarray) -> np.ndarray:
        """Leave-one-out errors (3 N, k) from errors of the fit."""
        rest = values - basis @ (basis.T @ values)
        return np.linalg.solve(own, rest.reshape(len(poses), 3, -1))

    errors = left_out((poses.position - at.position).reshape(-1, 1))[:, :, 0]
    standing, covariance = prediction_errors_with_covariance(placed, poses)
    roots = left_out(covariance.roots.reshape(3 * len(poses), -1))
    independent = (
        None if covariance.independent is None else _left_out_noise(covariance.independent, blocks, own)
    )
    count = covariance.roots.shape[2] - covariance.shared
    scatter = (roots[:, :, count:] ** 2).sum(axis=(1, 2))
    if independent is not None:
        scatter = scatter + np.trace(independent, axis1=1, axis2=2)
    result = PredictionErrors(
        position=poses.position - errors,
        errors=errors,
        parameter_rms=np.sqrt((roots[:, :, :count] ** 2).sum(axis=(1, 2))),
        scatter_rms=np.sqrt(scatter),
        ambiguous=standing.ambiguous,
    )
    left_out_covariance = replace(covariance, roots=roots, independent=independent, visit=None, common=None)
    before = (poses.position - predict_measurements(model, poses).position).ravel()
    probability = _unmoved(basis, before, covariance, float(np.mean(errors**2)))
    return RefittedVerification(tuple(what), placed, basis.shape[1], result, left_out_covariance, probability)


def _unmoved(basis: np.ndarray, errors: np.ndarray, covariance: ErrorCovariance, square: float) -> float:
    """Probability of `errors` (3 N,) m as large along the orthonormal `basis` (3 N, k) under their covariance (Hotelling 1931).

    `square` m² is the variance of a coordinate where neither instrument nor repeatability is known.
    """
    from scipy.special import fdtrc

    count = len(errors) // 3
    independent = covariance.independent
    if independent is None:
        independent = np.broadcast_to(square * np.eye(3), (count, 3, 3))
    blocks = basis.reshape(count, 3, -1)
    along = basis.T @ covariance.roots.reshape(len(errors), -1)
    variance = along @ along.T + np.einsum("nik,nij,njl->kl", blocks, independent, blocks, optimize=True)
    moved = basis.T @ errors
    size = len(moved)
    statistic = float(moved @ np.linalg.lstsq(variance, moved, rcond=None)[0]) / size
    return float(fdtrc(size, min(covariance.freedom, 1e9), statistic))


_WORDS = {"station": "the instrument", "point": "the measured point"}


def _names(poses: PoseSet, what: Sequence[Refit]) -> list[str]:
    names = []
    if "station" in what:
        names += [f"station.{s}.{key}" for s in poses.stations for key in ("x", "y", "z", "rx", "ry", "rz")]
    if "point" in what:
        names += [f"point.{target}.{key}" for target in poses.targets for key in "xyz"]
    return names


def _placed(model: RobotModel, poses: PoseSet, what: Sequence[Refit]) -> RobotModel:
    """Robot with the refitted placement from all poses."""
    if "station" not in what:
        return _points_found(model, poses)
    base = predict_measurements(with_stations_at_base(model), poses)
    at, turned = base.position, base.kinematics.orientation
    placement = best_placement(poses, at, turned) if "point" in what else rigid_placement(poses, at)
    return model.with_values(placement.values(model))


def _points_found(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with its points at the positions measured from known stations."""
    names = _names(poses, ("point",))
    robot = model
    for _ in range(_STEPS):
        at = predict_measurements(robot, poses, jacobians=True)
        columns = at.jacobian(names).reshape(3 * len(poses), -1)
        step = np.linalg.lstsq(columns, (poses.position - at.position).ravel(), rcond=_RANK)[0]
        values = {name: robot.value(name) + float(v) for name, v in zip(names, step, strict=True)}
        robot = robot.with_values(values)
        if np.abs(step).max() < _SMALL:
            break
    return robot


def _left_out_noise(independent: np.ndarray, blocks: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Covariance (N, 3, 3) m² of leave-one-out errors due to `independent` errors of all poses: own⁻¹ (I - H) Σ (I - H) own⁻¹."""
    across = blocks @ np.matmul(np.swapaxes(blocks, 1, 2), independent)
    weighted = np.einsum("nik,nij,njl->kl", blocks, independent, blocks, optimize=True)
    total = independent - across - np.swapaxes(across, 1, 2) + blocks @ weighted @ np.swapaxes(blocks, 1, 2)
    inverse = np.linalg.inv(own)
    return inverse @ total @ inverse
