"""Solution of a fit of the geometry to measured points, and the likelihood of its error model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.calibration.error_model import (
    LARGEST_WAVE,
    ErrorComponents,
    LinearFit,
    joint_components,
    joint_rotation_jacobian,
    joint_scatter,
)
from flexcal.calibration.fit.estimated_tolerances import widening
from flexcal.calibration.fit.least_squares_problem import GeometryProblem
from flexcal.calibration.fit.practical_identifiability import Undetermined, cause_of, undetermined
from flexcal.calibration.fit.temperature_evidence import TemperatureEvidence, time_columns, widened
from flexcal.calibration.fit.terms import plausible_size
from flexcal.calibration.fit.thermal_terms import is_thermal
from flexcal.calibration.measurement import RADIANS, ROBOT, PredictedMeasurements, stated_sigma
from flexcal.data.poses import PoseSet
from flexcal.estimation import RANK_TOLERANCE, Estimate, Parameter, Parameters, chi_square_limit
from flexcal.model.robot import REFERENCE, SCATTER, RobotModel, unit_of

if TYPE_CHECKING:
    from flexcal.calibration.fit.point_fit import PointFit

_CHI_MEDIAN = np.array([1.0, 0.455, 1.386, 2.366])
"""Medians of chi-square by degrees of freedom, up to three."""
_SUSPICION = 1e-3
"""Probability of suspecting an outlier without one."""
_SLACK = 1.5
"""Factor by which the squared scatter of few points, from their median, may be too small."""
_TOLD = 0.6
"""Standard deviation, relative to the plausible one, below which other robots tell a parameter: each of two whose sum they tell has 0.7."""
_FREE_STIFFNESS = 0.3
"""Relative 1σ of every stiffness about its prior while the scatter is estimated."""


@dataclass(frozen=True, eq=False)
class FittedPoints:
    """Solution of a fit: `estimate` of the fitted parameters, the prediction `at` the poses on `flank` (N, n)."""

    fit: PointFit
    scatter: ErrorComponents
    spread: dict[str, float]
    fixed: tuple[Undetermined, ...]
    estimate: Estimate
    at: PredictedMeasurements
    flank: np.ndarray
    task: GeometryProblem

    @property
    def model(self) -> RobotModel:
        """The fitted robot."""
        return self.at.model

    @cached_property
    def turns(self) -> np.ndarray:
        """Derivative (R, 3, r), per rad, of the readings with respect to a rotation of every revolute joint."""
        return joint_rotation_jacobian(self.at)

    @cached_property
    def inliers(self) -> np.ndarray:
        """Mask (R,) of the readings that a robust loss keeps."""
        return ~np.isin(self.at.readings.row, self.estimate.outliers)

    @cached_property
    def linear(self) -> LinearFit:
        """Fit linearised at its solution, without outliers.

        Stiffness is nearly free there: an error of stage 1 must not pass for scatter of the robot, which would hide it.
        """
        estimate, prior, readings = self.estimate, self.fit.prior, self.at.readings
        elastic = prior.parameters.names
        items = [estimate.parameters[name] for name in elastic]
        moved = Parameters(items)
        names = tuple(self.fit.waves)
        slopes, waves, columns = np.split(
            self.at.jacobian([*elastic, *names, *self.task.kept.names]),
            [len(elastic), len(elastic) + len(names)],
            axis=2,
        )
        slopes = slopes * moved.natural_slope(moved.coordinates())
        wide = [_FREE_STIFFNESS**2 if name.endswith(".stiffness") else 0.0 for name in elastic]
        values, vectors = np.linalg.eigh(prior.covariance + np.diag(wide))
        tied = slopes @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        residual = self.at.residual + slopes @ (moved.coordinates() - moved.prior_mean())
        residual = residual + waves @ np.array([estimate.values.get(name, 0.0) for name in names])
        free = ~np.isfinite(self.task.kept.prior_std())
        known = self.task.kept_covariance[np.ix_(~free, ~free)]
        shift = estimate.parameters.subset(self.task.kept.names).coordinates() - self.task.kept.prior_mean()
        tied = np.concatenate([tied, columns[:, :, ~free] @ np.linalg.cholesky(known)], axis=2)
        residual = residual + columns[:, :, ~free] @ shift[~free]
        columns = columns[:, :, free]
        scale = np.linalg.norm(columns, axis=(0, 1))
        rows = self.inliers
        # a rad counts as the largest lever of a point, m
        lever = np.where(readings.unit[rows] == RADIANS, self.fit.start.reach, 1.0).reshape(-1, 1)
        flat = (columns / np.where(scale > 0, scale, 1.0))[rows].reshape(3 * int(rows.sum()), -1)
        basis, sizes, _ = np.linalg.svd(lever * flat, full_matrices=False)
        basis = basis[:, sizes > RANK_TOLERANCE * sizes.max(initial=0.0)] / lever
        return LinearFit(
            residual[rows],
            basis.reshape(int(rows.sum()), 3, -1),
            tied[rows],
            (waves * np.array(list(self.fit.waves.values())))[rows],
            readings.subset(rows),
            self.turns[rows],
            self.fit.cells.subset(rows),
        )

    def estimated_scatter(self) -> tuple[ErrorComponents, dict[str, float]]:
        """Variance components of the residuals, and the standard deviation of each."""
        near = self.scatter if self.spread else None
        return self.linear.scatter(stated=self.fit.poses.sigma_given, near=near)

    def robust_scatter(self) -> ErrorComponents:
        """Common scatter of all coordinates of a unit, from the median of the residuals' distances."""
        present = self.at.readings.present
        rows = int(present.sum())
        spread = rows / max(rows - self.fit.unknowns, 1)
        squares = (self.at.residual**2).sum(axis=1) / _CHI_MEDIAN[present.sum(axis=1)]
        readings = self.at.readings
        groups = {n: readings.of_scatter(n).any(axis=1) for n in (ROBOT, *readings.instruments)}
        groups["orientation"] = ~readings.points
        found: dict[str, Any] = {"share": 0.0, ROBOT: 0.0}
        found |= {n: float(np.sqrt(np.median(squares[g]) * spread)) for n, g in groups.items() if g.any()}
        return ErrorComponents(**found)

    def undetermined(self, scatter: ErrorComponents) -> tuple[Undetermined, ...]:
        """Parameters that the poses do not determine under a given scatter."""
        fit = self.fit
        kept = Parameters(p for p in fit.free if not np.isfinite(p.prior_std))
        whitening = scatter.whitening(self.at.readings, self.turns)
        return undetermined(fit.straight, kept, whitening, fit.hidden, fit.plausible)

    def told_by_prior(self) -> tuple[Undetermined, ...]:
        """Parameters of which the points tell less than their prior, with the property of the poses that hides them."""
        told = dict(zip(self.estimate.parameters.names, self._identifiable(), strict=True))
        open_ = [n for n in self.fit.structural.kept_names if n in self.task.kept and not told[n]]
        hidden = [item for item in self.task.kept.subset(open_) if np.isfinite(item.prior_std)]
        return tuple(Undetermined(i.name, i.prior_std, cause_of(self.fit.straight, i.name)) for i in hidden)

    def has_residuals_of(self, other: FittedPoints) -> bool:
        """Whether the scatter would be estimated from the same residuals, outliers and parameters."""
        same = self.fixed == other.fixed and self.estimate.outliers == other.estimate.outliers
        return same and np.array_equal(self.at.residual, other.at.residual)

    @property
    def suspects_outliers(self) -> bool:
        """Whether single points deviate by more than the scatter of most others allows."""
        whitening = self.scatter.whitening(self.at.readings, self.turns)
        there = self.at.readings.present.any(axis=1)
        squares = (whitening(self.at.residual).reshape(-1, 3) ** 2).sum(axis=1)[there]
        freedom = self.at.readings.present.sum(axis=1)[there]
        chance = _SUSPICION / len(squares)
        limits = np.array([0.0, *(chi_square_limit(n, chance) for n in (1, 2, 3))])[freedom] * _SLACK
        return bool((squares > limits * np.median(squares / _CHI_MEDIAN[freedom])).any())

    @property
    def poses(self) -> PoseSet:
        """Poses; those without a stated sigma have that of the scatter."""
        poses, scatter = self.fit.poses, self.scatter
        if poses.stated.all():
            return poses
        variances = np.diagonal(
            replace(scatter, share=0.0).independent(self.at.readings, self.turns)[: len(poses)],
            axis1=1,
            axis2=2,
        )
        estimated = np.sqrt(variances + scatter.model**2)
        return replace(poses, sigma=np.where(poses.stated[:, None], poses.sigma, estimated))

    def whole_estimate(self) -> Estimate:
        """Estimate of all parameters: fitted, held (with the uncertainty due to holding them), and the scatter."""
        known = self.fit.known
        undetermined_names = [*(item.name for item in self.fixed), *known.names]
        dropped = tuple(d for d in self.fit.identifiability.dropped if d.name not in self.task.kept.names)
        turns = [f"station.{s}.{key}" for s in self.fit.poses.stations for key in ("rx", "ry", "rz")]
        names = dict.fromkeys([*undetermined_names, *(d.name for d in dropped)])
        every = self.fit.geometric + known
        items = [every[name] for name in names]
        items += [Parameter(n, "rad", self.model.value(n)) for n in turns if n not in self.fit.geometric]
        if self.temperature is not None:
            items.append(Parameter(REFERENCE, unit_of(REFERENCE), self.temperature[1].reference))
        estimate, fixed = replace(self.estimate, covariance=self._covariance()), Parameters(items)
        scatter, spread = self._scatter_parameters()
        size, all_ = len(estimate.parameters), len(estimate.parameters) + len(fixed) + len(scatter)
        covariance = np.zeros((all_, all_))
        covariance[:size, :size] = estimate.covariance
        count = len(undetermined_names)
        if count:
            gain = self._gain(undetermined_names)
            sizes = np.array([*(item.size for item in self.fixed), *known.prior_std()])
            covariance[:size, :size] += (gain * sizes**2) @ gain.T
            covariance[:size, size : size + count] = gain * sizes**2
            covariance[size : size + count, :size] = (gain * sizes**2).T
            covariance[range(size, size + count), range(size, size + count)] = sizes**2
        covariance[range(all_ - len(scatter), all_), range(all_ - len(scatter), all_)] = spread**2
        return replace(
            estimate,
            parameters=estimate.parameters + fixed + scatter,
            covariance=covariance,
            dropped=estimate.dropped + dropped,
            identifiable=self._identifiable() + (False,) * len(fixed) + tuple(bool(k > 0) for k in spread),
        )

    @cached_property
    def temperature(self) -> tuple[np.ndarray, TemperatureEvidence] | None:
        """Covariance (p, p) of the estimate with what time and the sensor have to do with its thermal parameters, and what is known of it;
        None without such parameters.
        """
        estimate, task = self.estimate, self.task
        names, poses = estimate.parameters.names, self.fit.poses
        if poses.temperature is None or not any(is_thermal(name) for name in names):
            return None
        narrow, thermal = self._independent_of_time(), tuple(name for name in names if is_thermal(name))
        columns = time_columns(self.at, thermal)
        slopes = estimate.parameters.natural_slope(estimate.parameters.coordinates())
        rows = np.repeat(self.inliers, 3)
        own = rows[:, None] * task.columns(self.at, names) * slopes
        products = self.linear.products_in_time(self.scatter, columns[self.inliers])
        wide, stds, probability = widened(
            poses,
            estimate.values,
            narrow,
            -estimate.covariance @ own.T @ task.whitening(columns),
            products,
            self.linear.freedom,
        )
        before = dict(zip(names, np.sqrt(np.diag(narrow)).tolist(), strict=True))
        reference = float(self.model.thermal.reference[0])
        alone = {name: before[name] for name in thermal}
        return wide, TemperatureEvidence.of(poses, reference, alone, stds, probability)

    def _covariance(self) -> np.ndarray:
        """Covariance (p, p) of the estimate, what else changes with time included where parameters change with temperature."""
        return self._independent_of_time() if self.temperature is None else self.temperature[0]

    def _independent_of_time(self) -> np.ndarray:
        """Covariance (p, p) of the estimate under errors V, where the weights V₀ assume independent, isotropic errors.

        Σ + G (V - V₀) Gᵀ with the estimate's response G = Σ Aᵀ V₀⁻¹ to errors of the points; Σ has the prior in it, to which is added what
        its sizes are uncertain by.
        """
        estimate, scatter, task = self.estimate, self.scatter, self.task
        slopes = estimate.parameters.natural_slope(estimate.parameters.coordinates())
        own = task.columns(self.at, estimate.parameters.names) * slopes
        white = own.reshape(-1, 3, len(slopes))[self.inliers] @ estimate.covariance
        respond = task.whitening.subset(self.inliers).transposed(white)
        linear = self.linear
        together = scatter.shared(linear.cells, respond)
        jointly = scatter.jointly(linear.readings, linear.turns, linear.cells)
        visits = linear.cells.gathered(respond)
        spread = np.einsum("gip,gij,gjq->pq", visits, jointly, visits, optimize=True)
        taken = np.einsum("nip,niq->pq", white, white, optimize=True)
        return (
            estimate.covariance
            + spread
            - taken
            + together.T @ together
            + self._by_sizes(own[np.repeat(self.inliers, 3)])
        )

    def _by_sizes(self, columns: np.ndarray) -> np.ndarray:
        """What adds to the covariance (p, p) of the estimate because the prior's sizes were estimated; nothing where they were not.

        `columns` (3 R, p) are the whitened ones of the readings that count.
        """
        estimate, task = self.estimate, self.task
        names = estimate.parameters.names
        kinds = {name: kind for name, kind in self.fit.kinds.items() if name in task.kept}
        if not kinds:
            return np.zeros((len(names), len(names)))
        shift = estimate.parameters.coordinates() - estimate.parameters.prior_mean()
        count = int(self.at.readings.present[self.inliers].sum())
        prior = task.prior_covariance[: len(names), : len(names)]
        return widening(columns.T @ columns, prior, shift, names, kinds, count)

    def _gain(self, names: list[str]) -> np.ndarray:
        """Sensitivity (p, h) of the estimates to held parameters: -Σ Aᵀ A_h of the whitened columns."""
        estimate = self.estimate
        slopes = estimate.parameters.natural_slope(estimate.parameters.coordinates())
        own = self.task.columns(self.at, estimate.parameters.names) * slopes
        return -estimate.covariance @ own.T @ self.task.columns(self.at, tuple(names))

    def _identifiable(self) -> tuple[bool, ...]:
        """Parameters of the estimate without those determined only by a declared prior or the variance of transmission errors.

        Where that is as large as it may be, the waves are larger than their prior, which pulls them towards zero by more than they err.
        """
        estimate = self.estimate
        stds = np.sqrt(np.diag(estimate.covariance))
        pulled = self.scatter.transmission > 0.99 * LARGEST_WAVE
        waves = {n: 0.0 if pulled else size * self.scatter.transmission for n, size in self.fit.waves.items()}
        beforehand = {p.name: p.prior_std for p in self.task.kept} | waves
        if self.fit.fleet is not None:
            # what other robots of the model tell is known; of a sum that they tell, neither of its two terms is
            beforehand |= {
                name: _TOLD * plausible_size(self.fit.start, name) for name in self.fit.fleet.names
            }
        known = zip(self.fit.prior.parameters, np.sqrt(np.diag(self.fit.prior.covariance)), strict=True)
        beforehand |= {p.name: std for p, std in known if p.name.endswith(".scale")}
        return tuple(
            told and bool(std < 0.8 * beforehand.get(p.name, np.inf))
            for p, told, std in zip(estimate.parameters, estimate.identifiable, stds, strict=True)
        )

    def _scatter_parameters(self) -> tuple[Parameters, np.ndarray]:
        scatter = self.scatter
        instrument = scatter.share * stated_sigma(self.at.readings)
        robot, robot_std = self._together("robot", "pose")
        model, model_std = self._together("workspace", "order", "command")
        values = (
            instrument,
            scatter.share,
            robot,
            scatter.angular,
            model,
            scatter.pose,
            scatter.transmission,
            scatter.orientation,
        )
        angular_std, pose_std, wave_std, orientation_std = (
            self.spread.get(name, 0.0) for name in ("angular", "pose", "transmission", "orientation")
        )
        # the points of the fit are all that speaks for a stated sigma
        share_std = scatter.share / np.sqrt(2 * max(self.estimate.degrees_of_freedom, 1))
        known = np.array(
            [0.0, share_std, robot_std, angular_std, model_std, pose_std, wave_std, orientation_std]
        )
        count = len(SCATTER) if self.fit.poses.angled.any() else len(SCATTER) - 1
        items = (
            Parameter(f"scatter.{key}", unit_of(f"scatter.{key}"), float(value), lower=0.0)
            for key, value in zip(SCATTER[:count], values, strict=False)
        )
        known = known[:count]
        if scatter.joints:
            names = joint_scatter(self.model)
            turning = zip(names, scatter.turning, strict=True)
            items = (*items, *(Parameter(n, unit_of(n), float(value), lower=0.0) for n, value in turning))
            known = np.append(known, [self.spread.get(name, 0.0) for name in joint_components(len(names))])
        return Parameters(items), known

    def _together(self, *names: str) -> tuple[float, float]:
        """Root sum of squares of components of the scatter, and its standard deviation."""
        sizes = np.array([getattr(self.scatter, name) for name in names])
        spread = np.array([self.spread.get(name, 0.0) for name in names])
        whole = float(np.linalg.norm(sizes))
        return whole, float(np.linalg.norm(sizes * spread)) / whole if whole > 0 else 0.0
