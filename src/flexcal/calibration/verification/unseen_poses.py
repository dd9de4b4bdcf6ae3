"""Accuracy of the calibrated robot at poses outside the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.error_model import (
    ErrorComponents,
    ErrorGroups,
    ErrorStatistics,
    block_columns,
    joint_rotation_jacobian,
    joint_scatter,
    known_scatter,
)
from flexcal.calibration.measurement import (
    PredictedMeasurements,
    Readings,
    ambiguous_poses,
    covariance_root,
    moving_parameters,
    predict_measurements,
    require_points,
    unknown_sides,
)
from flexcal.data.poses import PoseSet
from flexcal.model.robot import BOARD_SCALE, LENS, RobotModel
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class PredictionErrors:
    """Predicted and measured points of a set of poses.

    `position` (N, 3) as predicted, m; `errors` (N, 3) measured minus predicted. Root mean square distance errors (N,) m that are predicted:
    `parameter_rms` from the parameters' covariance, `scatter_rms` from instrument, robot and model error. `ambiguous` (N,) poses at which
    the flank of a backlash is not certain.
    """

    position: np.ndarray
    errors: np.ndarray
    parameter_rms: np.ndarray
    scatter_rms: np.ndarray
    ambiguous: np.ndarray

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.all}>"

    def summary(self) -> str:
        """Errors and their predicted size, as text."""
        predicted = float(np.sqrt(np.mean(self.expected_rms**2))) / MILLIMETRE
        observed = float(np.sqrt(np.mean(np.sum(self.errors**2, axis=1)))) / MILLIMETRE
        return f"errors: {self.all}\nroot mean square {observed:.3f} mm, predicted {predicted:.3f} mm"

    @property
    def expected_rms(self) -> np.ndarray:
        """Total predicted root mean square distance error (N,) m."""
        return np.hypot(self.parameter_rms, self.scatter_rms)

    @property
    def all(self) -> ErrorStatistics:
        """Statistics over all poses."""
        return ErrorStatistics.of(self.errors)

    @property
    def unambiguous(self) -> ErrorStatistics:
        """Statistics over the poses with a certain flank."""
        return ErrorStatistics.of(self.errors[~self.ambiguous])


@dataclass(frozen=True, eq=False)
class ErrorCovariance:
    """Covariance of the errors at N poses: `roots`_i `roots`_jᵀ (N, 3, k), m, between poses i and j, plus `independent` (N, 3, 3) m².

    The roots are of the parameters and, the last `shared` of them, of the model error that neighbouring poses have in common; independent
    are instrument and repeatability, None where neither was estimated nor stated. Of these the points of one `visit` (N,) to a pose
    share the columns `common` (N, 3, c) m; None where a pose has one point.
    `freedom` are the degrees of freedom of the predicted mean square, inf where scatter is known. `concentrated` (N,): by how much the
    squares of the whole independent covariance are larger than those of its blocks, as deviations from a common mean are correlated.
    """

    roots: np.ndarray
    shared: int
    independent: np.ndarray | None
    freedom: float = np.inf
    visit: np.ndarray | None = None
    common: np.ndarray | None = None
    concentrated: np.ndarray | None = None

    def by_visits(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Roots (G, 3 T, k) and independent covariance (G, 3 T, 3 T) of the points of a mask `rows` (N,), visit by visit."""
        roots = self.roots[rows]
        size = len(roots)
        own = np.zeros((size, 3, 3)) if self.independent is None else self.independent[rows]
        if self.visit is None or self.common is None:
            return roots, own
        visits = ErrorGroups(self.visit).subset(rows)
        common = visits.gathered(self.common[rows])
        together = common @ np.swapaxes(common, 1, 2)
        places = together.shape[1] // 3
        blocks, single = together.reshape(-1, places, 3, places, 3), visits.gathered(own)
        for k in range(places):
            blocks[:, k, :, k] = single[:, 3 * k : 3 * k + 3]
        return visits.gathered(roots), together


def prediction_errors(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True, noise_free: bool = False
) -> PredictionErrors:
    """Errors of a calibrated robot at measured points, with their predicted size.

    The instrument must stand where it stood during calibration: `model` holds its place.

    Parameters
    ----------
    model : RobotModel
        Calibrated robot.
    poses : PoseSet
        Measured points, none of which the robot was fitted to.
    elastic : bool
        Whether the arm deflects.
    noise_free : bool
        Whether the points are those of the true robot, without noise of instrument and repeatability.

    Returns
    -------
    PredictionErrors
        `errors` (N, 3), m, measured minus predicted; `all`, their statistics; `expected_rms` (N,), m, as predicted.

    Raises
    ------
    FlexcalError
        For measured lengths, and as `predict_measurements` does.

    Examples
    --------
    >>> from flexcal import RobotModel, fit_geometry, prediction_errors, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model)
    >>> fit = fit_geometry(model, poses.subset(slice(None, None, 13)), terms=("kinematic",))
    >>> unseen = poses.subset(slice(3, None, 13))
    >>> print(f"{prediction_errors(fit.model, unseen).all.mean * 1e3:.1f} mm")
    0.1 mm
    """
    return prediction_errors_with_covariance(model, poses, elastic=elastic, noise_free=noise_free)[0]


def prediction_errors_with_covariance(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True, noise_free: bool = False
) -> tuple[PredictionErrors, ErrorCovariance]:
    """As `prediction_errors`, with the joint covariance of the errors at all poses predicted from parameters and scatter."""
    require_points(poses)
    poses = poses.without_orientations()
    at = predict_measurements(model, poses, elastic=elastic, jacobians=True)
    used = [*moving_parameters(model, elastic=elastic), *_of_cameras(model, poses)]
    roots = np.concatenate([at.jacobian(used) @ covariance_root(model, used), unknown_sides(at)], axis=2)
    cells = ErrorGroups.of(poses)
    shared = _shared_errors(model, cells)
    scatter = None if noise_free else known_scatter(model, stated=poses.sigma_given)
    independent = None if scatter is None else _independent(model, scatter, at, poses)
    common = (
        scatter.common(at.readings, joint_rotation_jacobian(at))
        if scatter is not None and len(np.unique(cells.pose)) < len(poses)
        else None
    )
    squares = (shared**2).sum(axis=(1, 2))
    if independent is not None:
        squares = squares + np.trace(independent, axis1=1, axis2=2)
    verification = PredictionErrors(
        position=at.position,
        errors=at.residual,
        parameter_rms=np.sqrt((roots**2).sum(axis=(1, 2))),
        scatter_rms=np.sqrt(squares),
        ambiguous=ambiguous_poses(model, at),
    )
    freedom = (
        np.inf if noise_free else _freedom(model, at, poses, float(np.sum(verification.expected_rms**2)))
    )
    return verification, ErrorCovariance(
        np.concatenate([roots, shared], axis=2),
        shared.shape[2],
        independent,
        freedom,
        None if common is None else cells.pose,
        common,
    )


def _of_cameras(model: RobotModel, poses: PoseSet) -> list[str]:
    """Names of the calibrated parameters of the cameras that measured, and of their board."""
    if not poses.seen.any():
        return []
    names = [f"camera.{name}.{key}" for name in poses.lenses for key in LENS]
    return [name for name in (*names, BOARD_SCALE) if name in model.posterior.parameters]


def _freedom(model: RobotModel, at: PredictedMeasurements, poses: PoseSet, predicted: float) -> float:
    """Degrees of freedom of the `predicted` sum of squares, m², from the standard deviations of the scatter (Satterthwaite, 1946)."""
    known, rows = model.posterior, 3 * len(at.position)
    weights = {
        "scatter.robot": rows,
        "scatter.model": rows,
        "scatter.instrument_share": float(np.sum(poses.sigma**2)) if poses.sigma_given else 0.0,
    }
    turned = np.sum(joint_rotation_jacobian(at) ** 2, axis=(0, 1))
    if model.scatter.joints.any():
        weights |= dict(zip(joint_scatter(model), turned.tolist(), strict=True))
    else:
        weights["scatter.angular"] = float(turned.sum())
    seen = [name for name in weights if known.determines(name)]
    spread = [2 * model.value(n) * weights[n] * float(np.sqrt(known.marginal([n])[0, 0])) for n in seen]
    variance = float(np.sum(np.square(spread)))
    return 2 * predicted**2 / variance if variance > 0 else np.inf


def _shared_errors(model: RobotModel, cells: ErrorGroups) -> np.ndarray:
    """Columns (N, 3, k) m of the model error, common to the poses of a cell of the workspace."""
    blocks = (cells.workspace, cells.order, cells.pose)
    return model.value("scatter.model") * block_columns(next(own for own in blocks if own is not None))


def _independent(
    model: RobotModel, scatter: ErrorComponents, at: PredictedMeasurements, poses: PoseSet
) -> np.ndarray:
    """Covariance (N, 3, 3) m² of instrument and repeatability.

    Where the calibration had no sigma, the robot's part holds what its instrument scattered: of a stated one only what is beyond counts.
    """
    instrument, sigma = model.value("scatter.instrument"), poses.sigma
    if not poses.sigma_given:
        sigma = np.full(sigma.shape, instrument)
    elif instrument == 0 and model.scatter.std.any():
        sigma = np.sqrt(np.maximum(sigma**2 - scatter.robot**2, 0.0))
        scatter = replace(scatter, share=1.0)
    return scatter.independent(Readings.of(replace(poses, sigma=sigma)), joint_rotation_jacobian(at))
