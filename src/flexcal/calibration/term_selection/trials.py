"""Comparison of sets of terms by the errors at poses left out of their fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model import joint_rotation_jacobian
from flexcal.calibration.fit import LEVELS, GeometricFit, geometric_parameters, with_reference_temperature
from flexcal.calibration.measurement import (
    METRES,
    RADIANS,
    PredictedMeasurements,
    predict_measurements,
)
from flexcal.calibration.term_selection.leave_out_errors import LeaveOutErrors, LinearBasis
from flexcal.model.robot import GEOMETRY, HYSTERESIS, ORIGIN, STATION, RobotModel
from flexcal.units import MILLIMETRE, decimals

_WORSE = 1.05
"""Factor by which the largest error at a left-out pose may rise with a term."""


_FEW = 20
"""Degrees of freedom, parameters with a prior deducted, below which residuals do not tell the scatter."""
_LEAST_GAIN = 1e-12
"""Gain, m, below which it is a rounding error."""

_TINY = 1e-24
"""Mean square, rad², of orientations that were fitted exactly."""
_OUT = ("poses left out in measuring order", "poses left out in the workspace", "poses left out one by one")
_PLACES_OUT = "places of the fixture that are left out"


@dataclass(frozen=True)
class TermComparison:
    """Comparison of a considered term with the base terms; `term` is None for the base terms themselves.

    `terms` are those fitted, it among them; `order`, `workspace` the mean errors (m) with folds contiguous in measuring order and in the
    workspace, `single` with single poses left out, `largest` the largest of the errors that decide; NaN where it could not be tried.
    `bic` is the change of the Bayesian information criterion by the term, `reason` says in a clause why it was taken or left.
    """

    term: str | None
    terms: tuple[str, ...]
    order: float
    workspace: float
    single: float
    largest: float
    bic: float
    taken: bool
    reason: str


def not_tried(term: str, chosen: tuple[str, ...], reason: str) -> TermComparison:
    """Comparison row of a term that cannot be considered."""
    nan = float("nan")
    return TermComparison(term, (*chosen, term), nan, nan, nan, nan, nan, False, reason)


def _change(old: LeaveOutErrors, new: LeaveOutErrors, kinds: Sequence[int]) -> str:
    before, after = old.mean(kinds) / MILLIMETRE, new.mean(kinds) / MILLIMETRE
    digits = decimals(before) + 1
    return f"{before:.{digits}f} to {after:.{digits}f} mm"


def mean_gain(fold: np.ndarray, old: np.ndarray, new: np.ndarray) -> tuple[float, float]:
    """Mean gain (m) of new over old errors (N,) over the folds (N,), as independent units, and its standard error."""
    gain = old - new
    gains = np.array([gain[fold == k].mean() for k in np.unique(fold)])
    return float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(len(gains))) + _LEAST_GAIN


class TermTrials:
    """Linear fits of sets of terms about the fit of the `base` terms to all poses.

    `model` declares the joints with backlash; `folds` (N,) are those in measuring order, in the workspace, and single poses; `by` says
    which decide: the first two ("folds", or "places", of which they are), or the third ("poses").
    """

    def __init__(
        self,
        rigid: GeometricFit,
        model: RobotModel,
        base: tuple[str, ...],
        folds: tuple[np.ndarray, ...],
        *,
        by: str,
    ) -> None:
        self.rigid = rigid
        self.model = with_reference_temperature(replace(rigid.model, config=model.config), rigid.poses)
        self.folds = folds
        self.deciding = {"folds": (0, 1), "places": (0,), "poses": (2,)}[by]
        self._out = [_PLACES_OUT if by == "places" else text for text in _OUT]
        self._columns: dict[str, np.ndarray] = {}
        self._fits: dict[tuple[str, ...], LeaveOutErrors] = {}
        self._before: dict[tuple[str, ...], LinearBasis] = {}
        self._base = base

    def start(self) -> TermComparison:
        """Comparison row of the base terms."""
        return self._row(None, self._base, 0.0, taken=True, reason="")

    def compare(self, chosen: tuple[str, ...], term: str, extra: float) -> TermComparison:
        """Comparison of a term added to the chosen ones; `extra` is the further fall of the criterion required beyond 0."""
        terms = (*chosen, term)
        old, new = self.fit(chosen), self.fit(terms)
        bic = self._criterion(old, new)
        gains = {k: self._gain(old, new, k) for k in self.deciding}
        poorest = min(gains, key=lambda k: gains[k][0] / gains[k][1])
        most = [fit.largest(self.deciding) for fit in (old, new)]
        taken = False
        if gains[poorest][0] <= 0:
            reason = f"the mean error at {self._out[poorest]} does not fall ({_change(old, new, [poorest])})"
        elif gains[poorest][0] <= gains[poorest][1]:
            reason = f"the mean error at {self._out[poorest]} falls by less than the standard error ({_change(old, new, [poorest])})"
        elif bic >= -extra:
            reason = (
                f"the BIC rises by {bic:.0f}"
                if bic >= 0
                else f"the BIC falls by {-bic:.1f}, less than {extra:.1f}"
            )
        elif most[1] > _WORSE * most[0]:
            reason = f"the largest error at a left-out pose would rise from {most[0] / MILLIMETRE:.4f} to {most[1] / MILLIMETRE:.4f} mm"
        else:
            taken = True
            change = _change(old, new, self.deciding)
            reason = f"lowers the mean error at left-out poses from {change} and the BIC by {-bic:.0f}"
        return self._row(term, terms, bic, taken=taken, reason=reason)

    def compare_sets(self, chosen: tuple[str, ...], terms: tuple[str, ...], term: str) -> TermComparison:
        """Comparison of other terms, with `term`, with the chosen ones: taken where errors at left-out poses are no larger beyond the
        standard error.
        """
        old, new = self.fit(chosen), self.fit(terms)
        gains = [self._gain(old, new, k) for k in self.deciding]
        change = f"the mean error at left-out poses goes from {_change(old, new, self.deciding)}"
        taken = all(gain > -error for gain, error in gains)
        return self._row(term, terms, self._criterion(old, new), taken=taken, reason=change)

    def fit(self, terms: tuple[str, ...]) -> LeaveOutErrors:
        """Fit of some terms, with springs and inertia as in the base fit."""
        if terms not in self._fits:
            self._fits[terms] = self._left_out(self._basis(terms))
        return self._fits[terms]

    def decided(self, terms: tuple[str, ...]) -> LeaveOutErrors:
        """Fit of some terms, with the decisive kinds of folds alone, and the errors to expect from the scatter of the base fit."""
        folds = [self._row_folds[kind] for kind in self.deciding]
        left = self._basis(terms).left_out(folds, self._places, self._variances)
        return left.of_points(len(self.rigid.poses))

    def _basis(self, terms: tuple[str, ...]) -> LinearBasis:
        """Basis of some terms and of what has a prior; that without the last term is kept for others in its place."""
        if not terms:
            return LinearBasis.of(self._residual).extended(self._held, self._noise)
        if terms[:-1] not in self._before:
            self._before = {terms[:-1]: self._basis(terms[:-1])}
        return self._before[terms[:-1]].extended(self._block(terms[-1]), 0.0)

    def _left_out(self, basis: LinearBasis) -> LeaveOutErrors:
        order, workspace, alone = self._row_folds
        # folds in measuring order are those in the workspace where both are places of a fixture
        folds = (order, alone) if (order == workspace).all() else (order, workspace, alone)
        fit = basis.left_out(folds, self._places)
        if len(folds) < len(self._row_folds):
            fit = replace(fit, distances=(fit.distances[0], *fit.distances))
        return fit.of_points(len(self.rigid.poses))

    def determined(self) -> LeaveOutErrors:
        """Fit of those parameters of the base fit that its points determine."""
        held = [item.name for item in self.rigid.undetermined]
        kept = [name for name in self._free if name not in held]
        return self._left_out(self._basis(()).extended(self._seen(kept), 0.0))

    def mean(self, terms: tuple[str, ...]) -> float:
        """Mean error at left-out poses, m, over the decisive kinds of folds."""
        return self.fit(terms).mean(self.deciding)

    def scatter(self, terms: tuple[str, ...]) -> float:
        """Standard deviation, m, of a coordinate that a fit of some terms leaves, by its degrees of freedom."""
        fit = self.fit(terms)
        return float(np.sqrt(fit.squares / max(self._coordinates - fit.freedom, 1.0)))

    def _row(
        self, term: str | None, terms: tuple[str, ...], bic: float, *, taken: bool, reason: str
    ) -> TermComparison:
        fit = self.fit(terms)
        order, workspace, single = (float(d.mean()) for d in fit.distances)
        largest = fit.largest(self.deciding)
        return TermComparison(term, terms, order, workspace, single, largest, bic, taken, reason)

    def _criterion(self, old: LeaveOutErrors, new: LeaveOutErrors) -> float:
        """Change of the Bayesian information criterion of the coordinates that the base terms leave free (Schwarz 1978)."""
        free = max(self._coordinates - self.fit(self._base).freedom, 1.0)
        return free * np.log(new.squares / old.squares) + (new.freedom - old.freedom) * np.log(free)

    def _gain(self, old: LeaveOutErrors, new: LeaveOutErrors, kind: int) -> tuple[float, float]:
        return mean_gain(self.folds[kind], old.distances[kind], new.distances[kind])

    @cached_property
    def _places(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Rows (m,) at each place of a fixture with sockets, and their derivatives (m, 3, 6) by that place."""
        poses, places = self.rigid.poses, []
        for fixture in poses.fixtures:
            rows = np.flatnonzero(poses.in_socket & (poses.station == fixture))
            columns = self._seen([f"station.{fixture}.{key}" for key in STATION])
            places.append((rows, columns[rows]))
        return places

    @cached_property
    def _prediction(self) -> PredictedMeasurements:
        return predict_measurements(
            self.model, self.rigid.poses, elastic=bool(self.model.elastic), jacobians=True
        )

    @cached_property
    def _lever(self) -> np.ndarray:
        """Factors (R, 1), m/rad for orientations, that make all readings scatter alike."""
        unit, residual = self._prediction.readings.unit, self.rigid.readings
        lengths, angles = unit == METRES, unit == RADIANS
        lever = np.ones(unit.shape)
        if angles.any():
            lever[angles] = np.sqrt(
                np.mean(residual[lengths] ** 2) / (np.mean(residual[angles] ** 2) + _TINY)
            )
        return lever[:, :1]

    @cached_property
    def _residual(self) -> np.ndarray:
        """Residuals (R, 3) of the base fit, as lengths, m."""
        return self.rigid.readings * self._lever

    @property
    def _variances(self) -> np.ndarray:
        """Variances (R, 3), m², of the readings by the scatter of the base fit; zero where nothing was measured."""
        at, scatter = self._prediction, self.rigid.scatter
        own = scatter.independent(at.readings, joint_rotation_jacobian(at))
        whole = np.einsum("rii->ri", own) + scatter.systematic(at.readings)
        return np.where(at.readings.present, whole, 0.0) * self._lever**2

    @cached_property
    def _coordinates(self) -> int:
        """Number of measured coordinates."""
        return int(self._prediction.readings.present.sum())

    @cached_property
    def _row_folds(self) -> tuple[np.ndarray, ...]:
        """Folds (R,) of the readings."""
        return tuple(fold[self._prediction.readings.row] for fold in self.folds)

    @cached_property
    def _noise(self) -> float:
        if len(self._known) > self.rigid.linear.freedom - _FEW:
            # with a prior of every parameter nearly nothing may be left
            return float(self._variances.sum()) / self._coordinates
        freedom = max(self._coordinates - self.rigid.identifiability.rank, 1)
        return float((self._residual**2).sum()) / freedom

    @cached_property
    def _known(self) -> dict[str, float]:
        """Prior standard deviations of the geometric parameters that have one."""
        every = self.rigid.estimate.parameters
        return {
            item.name: item.prior_std
            for item in every
            if np.isfinite(item.prior_std)
            and item.name.rpartition(".")[2] in (*GEOMETRY, *ORIGIN, HYSTERESIS)
            and item.name not in self._of_fleet
        }

    @property
    def _of_fleet(self) -> tuple[str, ...]:
        """Parameters with a prior from other robots of the model."""
        return () if self.rigid.fleet is None else self.rigid.fleet.names

    @cached_property
    def _free(self) -> list[str]:
        """Parameters that the points determine by rank, without those that have a prior."""
        known = (*self._known, *self._of_fleet)
        return [name for name in self.rigid.identifiability.kept_names if name not in known]

    @cached_property
    def _held(self) -> np.ndarray:
        """Columns (R, 3, k) of springs, inertia and geometry with a prior, in its standard deviations."""
        prior, names = self.rigid.prior, tuple(self._known)
        known = self._seen(names) * np.array([self._known[name] for name in names])
        if self.rigid.fleet is not None:
            own = self._seen(self._of_fleet) @ np.linalg.cholesky(self.rigid.fleet.covariance)
            known = np.concatenate([known, own], axis=2)
        if not len(prior.parameters):
            return known
        parameters = self.rigid.estimate.parameters.subset(prior.parameters.names)
        slope = parameters.natural_slope(parameters.coordinates())
        elastic = self._seen(parameters.names) * slope @ np.linalg.cholesky(prior.covariance)
        return np.concatenate([known, elastic], axis=2)

    def _block(self, term: str) -> np.ndarray:
        if term not in self._columns:
            if term in LEVELS:
                names = tuple(
                    n for n in self._free if n.rpartition(".")[2] in (*GEOMETRY, *ORIGIN, *STATION, "zero")
                )
            else:
                every = geometric_parameters(self.model, self.rigid.poses, [term]).names
                names = tuple(n for n in every if n not in self._of_fleet)
            self._columns[term] = self._seen(names)
        return self._columns[term]

    def _seen(self, names: Sequence[str]) -> np.ndarray:
        return self._prediction.jacobian(names) * self._lever[:, :, None]
