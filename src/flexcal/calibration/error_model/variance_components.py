"""Variance components of the errors of measured points, by restricted maximum likelihood (Patterson & Thompson 1971)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model.error_components import ErrorComponents
from flexcal.calibration.error_model.groups import ErrorGroups
from flexcal.calibration.error_model.point_sums import PointSums, joint_components
from flexcal.calibration.error_model.restricted_likelihood import RestrictedLikelihood
from flexcal.calibration.measurement import METRES, OF_INSTRUMENTS, RADIANS, ROBOT, Readings

_CLEAR_GAIN = 3.0
"""Gain in log-likelihood from which a stated sigma counts as too large (p = 0.01, one parameter at its bound)."""
_SUPPORTED = 2.7
"""Gain in log-likelihood from which a component is significant (p = 0.01, one variance at its bound of zero)."""
_CERTAIN = 6.0
"""Variance, relative to its standard deviation, from which a component is significant without a trial."""
_TOLD_APART = 1e6
"""Condition number of the correlation of the variances up to which their standard deviations are of use for that."""
_LARGEST = 30.0
"""Upper bound of a component, relative to the variance about the fit."""
LARGEST_WAVE = 3e-5
"""Largest standard deviation, rad, of a transmission error of order 1, of gears accurate to about half an arcminute. Errors that are none
of gears may ask for ten times as much, and waves of that size fit a part of a joint's range and are millimetres off in the rest.
"""
_NEGLIGIBLE = 1e-4
"""Share of the total variance below which a component is zero."""
TRANSMISSION = "transmission"
"""Name of the component of transmission errors."""
_SMALLEST = 1e-9
"""Share of the total variance that bounds a component from below."""
_START = 0.01
"""Least share of the total variance from which the search for a component begins."""
_ALONE = 0.9
"""Share of the total variance at which the search for a stated sigma's part begins, the only error of single points then."""
ORIENTATION = "orientation"
_STEPS, _HALVINGS = 60, 30
_FEW = 20
"""Degrees of freedom, parameters with a prior deducted, below which the scatter has a prior."""
USUAL_SCATTER, SCATTER_SPREAD = {ROBOT: 5e-5, ORIENTATION: 2e-4}, float(np.log(2.0))
"""Usual scatter of a coordinate, m, or of an orientation, rad, and the half width of the Cauchy distribution of its logarithm, which
leaves room for cameras that scatter a hundred times as much."""
_ALWAYS = (ROBOT, *OF_INSTRUMENTS, ORIENTATION)
"""Components that the data need not support: points and orientations scatter."""
_STILL = 1e-5
"""Change of the deviance, by its slope, below which the maximisation has converged."""
_COMPARABLE = 1e-2
"""The same where only the likelihood counts, beside another by `_CLEAR_GAIN`."""
_TO_ZERO = 0.1
"""Share of a variance with a prior factor that a step leaves of it at least."""
_ARMIJO = 1e-4
"""Share of the predicted change that a step must achieve (Armijo 1966)."""


@dataclass(frozen=True, eq=False)
class _Maximum:
    """Maximum of the restricted likelihood by the `variances` (k,) of the components `names`, its logarithm `likelihood`.

    `scale` (k,) are the units of the search; `at` is the likelihood evaluated there, whose names begin with these.
    """

    names: list[str]
    scale: np.ndarray
    variances: np.ndarray
    likelihood: float
    at: RestrictedLikelihood

    @property
    def relative(self) -> np.ndarray:
        """Variances (k,) in units of `scale`."""
        return self.variances / self.scale

    @property
    def information(self) -> np.ndarray:
        """Average information (k, k) of the variances, of the likelihood."""
        count = len(self.names)
        return 0.5 * self.at.information[:count, :count]


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Fit linearised at its solution: `residual` (R, 3) = `free` x + `tied` z + error, z standard normal a priori.

    `readings` says what is in m and what in rad, and what is stated of their noise; `free` (R, 3, p) and `tied` (R, 3, t) are in these
    units; `waves` (R, 3, w), per rad, move the readings with the waves of transmission errors, `turns` (R, 3, r) with rotations of the
    joints; `cells` say which readings share an error.
    """

    residual: np.ndarray
    free: np.ndarray
    tied: np.ndarray
    waves: np.ndarray
    readings: Readings
    turns: np.ndarray
    cells: ErrorGroups

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residual: coordinates that are there, less the parameters."""
        return int(self.readings.present.sum()) - self.free.shape[2]

    def products(self, scatter: ErrorComponents, columns: np.ndarray) -> np.ndarray:
        """Scalar products (k + 1, k + 1) of further `columns` (N, 3, k) m and, last, the residual, after projection off the parameters.

        They are weighted by the inverse of the residual's marginal covariance, the `tied` numbers and shared errors integrated out.
        """
        shared = [*([TRANSMISSION] if self.waves.size else []), *self.cells.blocks]
        names = [name for name in shared if getattr(scatter, name) > 0]
        sums = PointSums.of(self, columns)
        last = sums.columns.shape[2]
        own = np.arange(last - columns.shape[2] - 1, last)
        return RestrictedLikelihood.of(sums, names, scatter).products(own)

    def products_in_time(self, scatter: ErrorComponents, columns: np.ndarray) -> np.ndarray:
        """`products` of columns that change in time, without the errors of stretches of the measuring order, which would take them up."""
        return self.products(replace(scatter, order=0.0), columns)

    def scatter(
        self, *, stated: bool, near: ErrorComponents | None = None
    ) -> tuple[ErrorComponents, dict[str, float]]:
        """Estimated components, and the standard deviation of each that is not zero; the search begins `near` known ones.

        Where a sigma is `stated`, the instrument's part is that, or less where the points scatter clearly less than it says.
        """
        # few readings tell no kinds of scatter apart
        blocks = list(self.cells.blocks) if self._tells_scatter else []
        shared = [*([TRANSMISSION] if self.waves.size else []), *blocks]
        totals = self._mean_squares()
        # inclinometers alone have no reading in metres
        unit, first = (METRES, ROBOT) if ROBOT in totals else (RADIANS, ORIENTATION)
        own = [*self.readings.instruments]
        own += [ORIENTATION] if ORIENTATION in totals and first != ORIENTATION else []
        kinds = [*(["pose"] if self._several else []), "angular"] if self._tells_scatter else []
        names = [first, *own, *kinds, *shared]
        levers = {
            name: _lever(moved[self.readings.unit == unit])
            for name, moved in (("angular", self.turns), (TRANSMISSION, self.waves))
        }
        sizes = {name: totals[first] / levers.get(name, 1.0) for name in names} | totals
        scale = np.array([sizes[name] for name in names])
        share = 1.0 if stated else 0.0
        start = (
            None
            if near is None
            else np.maximum(np.array([getattr(near, name) for name in names]) ** 2 / scale, _START)
        )
        best = self._maximum(names, scale, share, start)
        if stated:
            # the points may scatter less than the instrument alone should, even if nothing else errs
            of_first = self.readings.of_scatter(ROBOT) if first == ROBOT else self.readings.unit == RADIANS
            whole = totals[first] / float(np.mean(self.readings.sigma[of_first] ** 2))
            narrow = [*own, *shared]
            tried = np.array([*(sizes[name] for name in narrow), whole])
            shared_out = np.append(best.relative[np.isin(names, narrow)], 1.0)
            alone = self._maximum(
                [*narrow, "share"], tried, None, shared_out, favour=False, still=_COMPARABLE
            ).likelihood
            # without the prior factor the maximum is this high at least
            power = np.array([self._favour(name) for name in names])
            reached = best.likelihood - 0.5 * float(power @ np.log(best.relative))
            if (
                alone - reached > _CLEAR_GAIN
                and alone
                - self._maximum(
                    names, scale, share, best.relative, favour=False, still=_COMPARABLE
                ).likelihood
                > _CLEAR_GAIN
            ):
                names, scale = [first, *narrow], np.append(totals[first], tried[:-1])
                narrower = self._maximum([*names, "share"], np.append(scale, whole), None)
                share = float(np.sqrt(narrower.variances[-1]))
                best = replace(narrower, names=names, scale=scale, variances=narrower.variances[:-1])
        best = self._supported(best, share)
        stds = dict(zip(best.names, np.sqrt(best.variances).tolist(), strict=True))
        negligible = best.relative <= _NEGLIGIBLE
        negligible[0] &= self._tells_scatter
        seen = self._without(best, negligible, share)
        components = ErrorComponents(share=share, **{name: stds[name] for name in seen.names})
        if self._several and components.angular > 0 and self.turns.shape[2] > 1:
            return self._by_joints(seen, share)
        return components, _uncertainties(seen)

    def _by_joints(self, best: _Maximum, share: float) -> tuple[ErrorComponents, dict[str, float]]:
        """Components with a repeatability of each joint, which the points of one visit tell apart, and their standard deviations.

        Beforehand each is as large as that of all joints within a factor, whose logarithm is Cauchy distributed.
        """
        whole = best.names.index("angular")
        joints = joint_components(self.turns.shape[2])
        rest = [name for name in best.names if name != "angular"]
        common = float(best.variances[whole])
        sizes = np.append(np.delete(best.scale, whole), np.full(len(joints), best.scale[whole]))
        start = np.append(np.delete(best.relative, whole), np.full(len(joints), best.relative[whole]))
        found = self._maximum([*rest, *joints], sizes, share, start, around=dict.fromkeys(joints, common))
        stds = dict(zip(found.names, np.sqrt(found.variances).tolist(), strict=True))
        turning = np.array([stds.pop(name) for name in joints])
        angular = float(np.sqrt(np.mean(turning**2)))
        components = ErrorComponents(
            share=share, angular=angular, joints=tuple((turning / angular).tolist()), **stds
        )
        spread = _uncertainties(found)
        spread["angular"] = float(
            np.linalg.norm(turning * [spread[name] for name in joints]) / (len(joints) * angular)
        )
        return components, spread

    def _supported(self, best: _Maximum, share: float) -> _Maximum:
        """Model error, and the components of repeatability supported by the data, by backward elimination with a likelihood-ratio test.

        Components far from zero are not tried: the likelihood falls by much more than the test asks for.
        """
        best = self._without(best, (best.relative <= _NEGLIGIBLE) & ~np.isin(best.names, _ALWAYS), share)
        optional = {name for name in best.names[1:] if name not in _ALWAYS and not self._favour(name)}
        if optional:
            optional -= _certain(best)
        while optional:
            trials = []
            for k, name in enumerate(best.names):
                if k == 0 or name not in optional:
                    continue
                near = np.delete(best.relative, k)
                near[0] += best.relative[k] / 2
                rest = [other for other in best.names if other != name]
                trials.append(self._maximum(rest, np.delete(best.scale, k), share, near))
            next_best = max(trials, key=lambda trial: trial.likelihood)
            if best.likelihood - next_best.likelihood > _SUPPORTED:
                break
            optional -= {*best.names} - {*next_best.names}
            best = next_best
        return best

    def _without(self, best: _Maximum, negligible: np.ndarray, share: float) -> _Maximum:
        """The same maximum without the components (k,) that are `negligible`."""
        if not negligible.any():
            return best
        names = [name for name, out in zip(best.names, negligible, strict=True) if not out]
        variances = best.variances[~negligible]
        at = self._at(names, variances, share)
        return replace(best, names=names, scale=best.scale[~negligible], variances=variances, at=at)

    def _favour(self, name: str) -> float:
        """Power of a standard deviation in the prior factor of the likelihood: 1 for transmission errors, together 1 for other model
        errors.

        Few poses would often put these at zero, which claims to know that there are none (Chung, Rabe-Hesketh, Dorie, Gelman & Liu 2013).
        """
        if name == TRANSMISSION:
            return 1.0
        return 1.0 / len(self.cells.blocks) if name in self.cells.blocks else 0.0

    @cached_property
    def _tells_scatter(self) -> bool:
        """Whether there are enough readings to estimate the scatter beside all parameters, those with a prior among them."""
        return self.freedom - self.tied.shape[2] >= _FEW

    @property
    def _several(self) -> bool:
        """Whether any visit to a pose has several points."""
        return bool(
            np.bincount(self.cells.pose[(self.readings.unit == METRES).any(axis=1)]).max(initial=0) > 1
        )

    def _mean_squares(self) -> dict[str, float]:
        """Residual variance of a coordinate by the component that it has for itself, with the parameters' degrees of freedom deducted."""
        readings = self.readings
        units = {name: readings.of_scatter(name).ravel() for name in (ROBOT, *readings.instruments)}
        units = {name: own for name, own in units.items() if own.any()}
        if (turned := (readings.unit == RADIANS).ravel()).any():
            units[ORIENTATION] = turned
        # what parameters with a prior explain is no scatter either, where there are readings enough to tell
        columns = np.concatenate([self.free, self.tied], axis=2) if self._tells_scatter else self.free
        rows, size = self.residual.size, columns.shape[2]
        residual, free = self.residual.ravel(), columns.reshape(rows, size)
        weight = np.ones(rows)
        for own in units.values():
            weight[own] = 1 / (float(np.sqrt(np.mean(residual[own] ** 2))) + 1e-12)
        basis = np.linalg.qr(weight[:, None] * free)[0]
        left = residual - basis @ (basis.T @ (weight * residual)) / weight
        taken = np.sum(basis**2, axis=1)
        return {
            unit: float(left[own] @ left[own]) / max(int(own.sum()) - float(taken[own].sum()), 1) + 1e-24
            for unit, own in units.items()
        }

    def _maximum(
        self,
        names: list[str],
        scale: np.ndarray,
        share: float | None,
        near: np.ndarray | None = None,
        *,
        favour: bool = True,
        still: float = _STILL,
        around: Mapping[str, float] | None = None,
    ) -> _Maximum:
        """Maximum of the restricted likelihood; `share` None: it is the last of the variances.

        Newton's steps with the average information, cut at the bounds. `near` (k,) is where to begin, in units of `scale`. The
        likelihood is multiplied by each standard deviation to the power of `_favour`, unless not to `favour` any. It has converged when
        the deviance changes by less than `still`, by its slope. Components `around` a variance have the prior of `SCATTER_SPREAD` there.
        """
        start = np.full(len(names), 0.7 / len(names)) if near is None else near.copy()
        largest = np.full(len(names), _LARGEST)
        waves = np.array(names) == TRANSMISSION
        largest[waves] = np.minimum(_LARGEST, LARGEST_WAVE**2 / scale[waves])
        if share is None:
            start[-1], largest[-1] = _ALONE, min(1.0 / float(scale[-1]), _LARGEST)
        x = np.clip(start, _SMALLEST, largest)
        at = self._at(names, x * scale, share)
        favoured = np.array([self._favour(name) if favour else 0.0 for name in names])
        known, usual = np.zeros(len(names)), np.ones(len(names))
        if not self._tells_scatter and names[0] in USUAL_SCATTER:
            known[0], usual[0] = 0.25 / SCATTER_SPREAD**2, USUAL_SCATTER[names[0]] ** 2 / scale[0]
        for k, name in enumerate(names):
            if around is not None and name in around:
                known[k], usual[k] = 0.25 / SCATTER_SPREAD**2, around[name] / scale[k]

        def deviance(x: np.ndarray, at: RestrictedLikelihood) -> float:
            of_prior = 2 * float(np.log1p(known * np.log(x / usual) ** 2).sum())
            return at.deviance - float(favoured @ np.log(x)) + of_prior

        for _ in range(_STEPS):
            pull = 4 * known / (1 + known * np.log(x / usual) ** 2)
            slope = at.slopes * scale - (favoured - pull * np.log(x / usual)) / x
            information = at.information * scale * scale[:, None] + np.diag((favoured + pull) / x**2)
            step = _step(x, slope, information, largest)
            # the factor's logarithm is steep near zero: a step that lands there returns by doubling
            smallest = np.maximum(_SMALLEST, np.where(favoured + known > 0, _TO_ZERO * x, 0.0))
            if -float(slope @ step) < still:
                # the likelihood and its information are those before the last step
                x = np.clip(x + step, smallest, largest)
                break
            for _ in range(_HALVINGS):
                tried = np.clip(x + step, smallest, largest)
                after = self._at(names, tried * scale, share)
                if deviance(tried, after) <= deviance(x, at) + _ARMIJO * float(slope @ (tried - x)):
                    break
                step /= 2
            else:
                break
            x, at = tried, after
        return _Maximum(names, scale, x * scale, -0.5 * deviance(x, at), at)

    @cached_property
    def _sums(self) -> PointSums:
        return PointSums.of(self)

    def _at(self, names: list[str], variances: np.ndarray, share: float | None) -> RestrictedLikelihood:
        known = dict(zip(names, variances.tolist(), strict=True))
        squared = known.get("share", 0.0) if share is None else share**2
        stds = {name: float(np.sqrt(value)) for name, value in known.items() if name != "share"}
        turning = [stds.pop(name) for name in joint_components(self.turns.shape[2]) if name in stds]
        if turning:
            stds["angular"] = 1.0
        scatter = ErrorComponents(share=float(np.sqrt(squared)), joints=tuple(turning), **stds)
        return RestrictedLikelihood.of(self._sums, names, scatter)


def _certain(best: _Maximum) -> set[str]:
    """Components whose variance is many of its standard deviations from zero, by the average information; none if that is singular."""
    sizes = np.sqrt(np.maximum(np.diag(best.information), 0.0))
    if not sizes.all():
        return set()
    related = best.information / (sizes * sizes[:, None])
    if np.linalg.cond(related) > _TOLD_APART:
        return set()
    stds = np.sqrt(np.diag(np.linalg.inv(related))) / sizes
    return {name for name, far in zip(best.names, best.variances > _CERTAIN * stds, strict=True) if far}


def _uncertainties(best: _Maximum) -> dict[str, float]:
    """Standard deviations of the components, from the average information."""
    if not best.names:
        return {}
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(best.information)), 0.0))
    stds = spread / (2 * np.sqrt(best.variances))
    return dict(zip(best.names, stds.tolist(), strict=True))


def _lever(moved: np.ndarray) -> float:
    """Mean square of K coordinates (m²) due to columns (K, k) together; 1 where there are none."""
    return float((moved**2).sum()) / len(moved) or 1.0


def _step(x: np.ndarray, slope: np.ndarray, information: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """Newton step (k,) of the variances that are not at a bound which it would cross."""
    free = ~(((x <= _SMALLEST) & (slope > 0)) | ((x >= largest) & (slope < 0)))
    while True:
        step = np.zeros(len(x))
        step[free] = -np.linalg.lstsq(information[np.ix_(free, free)], slope[free], rcond=None)[0]
        crossing = ((x <= _SMALLEST) & (step < 0)) | ((x >= largest) & (step > 0))
        if not crossing.any():
            return step
        free &= ~crossing
