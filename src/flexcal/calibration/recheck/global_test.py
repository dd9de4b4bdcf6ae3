"""Test of a visit's errors against those of a robot as calibrated, directed at single changes, at a level that holds exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.recheck.change_effects import PossibleChange
from flexcal.calibration.recheck.visit_errors import VisitErrors

FALSE_ALARM = 0.01
"""Probability of an alarm at a visit where nothing changed, of all tests together."""
VISIT_ALARM = 0.008
"""That of the test of the visit alone; the sums over the visits have the rest."""
ALIKE = 2 * np.log(20.0)
"""Difference of twice the log-likelihood below which two changes explain the same about as well: odds of 20."""
_DRAWS = 20_000
_RANK = 1e-6
_SEEN = 1e-3
"""Share of an effect that the fitted place of the instrument must leave for the change to be seen."""


@dataclass(frozen=True, eq=False)
class SeenChange:
    """A change in whitened coordinates: `columns` (m, k), an orthonormal `basis` (m, r) of them, and the `share` of the effect that is
    left beside the fitted place of the instrument.
    """

    change: PossibleChange
    columns: np.ndarray
    basis: np.ndarray
    share: float

    @property
    def seen(self) -> bool:
        """Whether the visit sees it at all."""
        return self.share > _SEEN and self.basis.shape[1] > 0


@dataclass(frozen=True, eq=False)
class GlobalTest:
    """Whitened errors (m,) of a visit, its possible changes, and the test whether it is as calibrated.

    The statistic is the smallest of the p-values of the whole (m degrees of freedom) and of every change alone, by F where the size of the
    scatter is itself estimated (Tippett 1931). Its distribution, with all correlations, is drawn from normal errors, so that the
    level holds whatever the number of changes.
    """

    errors: VisitErrors
    whitening: np.ndarray
    seen: tuple[SeenChange, ...]
    unseen: tuple[PossibleChange, ...]
    freedom: float
    least: np.ndarray
    directed: bool = False

    @classmethod
    def of(
        cls, errors: VisitErrors, changes: Sequence[PossibleChange], *, directed: bool = False
    ) -> GlobalTest:
        """Test of `errors` for `changes`; those of the instrument's place are no changes where it is fitted to the visit.

        A `directed` test has the parts of the changes alone, without that of the whole, for a scatter that is estimated from what the
        changes leave of these errors.
        """
        root = np.linalg.cholesky(errors.covariance)
        whitening = np.linalg.inv(root)
        if errors.placed:
            place = np.hstack([c.columns for c in changes if c.kind == "instrument_moved"])
            taken = _basis(whitening @ place)
            whole = np.linalg.qr(np.hstack([taken, np.eye(len(taken))]))[0]
            whitening = whole[:, taken.shape[1] :].T @ whitening
        items = [
            seen_change(change, whitening, root)
            for change in changes
            if not (errors.placed and change.kind == "instrument_moved")
        ]
        seen = tuple(item for item in items if item.seen)
        unseen = tuple(item.change for item in items if not item.seen)
        test = cls(errors, whitening, seen, unseen, errors.freedom, np.zeros(0), directed)
        return replace(test, least=np.sort(test.least_of(_DRAWS)))

    @property
    def size(self) -> int:
        """Number m of whitened coordinates."""
        return len(self.whitening)

    @property
    def level(self) -> float:
        """p-value of a single part at which the whole is at the level of false alarms."""
        return float(self.least[int(VISIT_ALARM * len(self.least))])

    def probability(self, values: np.ndarray) -> float:
        """Probability that chance makes the errors (3 K,), m, as conspicuous."""
        whitened = self.whitening @ values
        parts = [(float(np.sum((s.basis.T @ whitened) ** 2)), s.basis.shape[1]) for s in self.seen]
        if not self.directed:
            parts.append((float(whitened @ whitened), self.size))
        least = min((self.chance(part, count) for part, count in parts), default=1.0)
        return (1 + int(np.searchsorted(self.least, least, side="right"))) / (1 + len(self.least))

    def chance(self, statistic: float | np.ndarray, count: int) -> float | np.ndarray:
        """Probability that chance makes a sum of squares of `count` whitened values as large."""
        return chance_of_squares(statistic, count, self.freedom)

    def cost(self, misfit: float) -> float:
        """Twice the negative log-likelihood of errors with a whitened sum of squares, but for a constant: normal, or of Student's
        multivariate t where the size of the scatter is estimated.
        """
        if not np.isfinite(self.freedom):
            return misfit
        return (self.freedom + self.size) * float(np.log1p(misfit / self.freedom))

    def least_of(self, draws: int, effect: np.ndarray | None = None, seed: int = 0) -> np.ndarray:
        """Smallest p-values (draws,) of normal errors, of mean `effect` (m,) in whitened coordinates."""
        rng = np.random.default_rng(seed)
        stacked = np.hstack([item.basis for item in self.seen] or [np.zeros((self.size, 0))])
        span = _basis(stacked)
        rest = self.size - span.shape[1]
        drawn = rng.standard_normal((draws, span.shape[1]))
        other = rng.chisquare(rest, draws) if rest else np.zeros(draws)
        size = rng.chisquare(self.freedom, draws) / self.freedom if np.isfinite(self.freedom) else 1.0
        if effect is not None:
            drawn = drawn + span.T @ effect
        # of changes with as many parameters, the largest part has the smallest p-value
        largest = {} if self.directed else {self.size: np.sum(drawn**2, axis=1) + other}
        for item in self.seen:
            count = item.basis.shape[1]
            part = np.sum((drawn @ (span.T @ item.basis)) ** 2, axis=1)
            largest[count] = np.maximum(part, largest.get(count, 0.0))
        least = np.ones(draws)
        for count, part in largest.items():
            least = np.minimum(least, self.chance(part / size, count))
        return least


def chance_of_squares(statistic: float | np.ndarray, count: int, freedom: float) -> float | np.ndarray:
    """Probability that chance makes a sum of squares of `count` whitened values as large: F, or χ² where the scatter is known."""
    from scipy.special import chdtrc, fdtrc

    return fdtrc(count, freedom, statistic / count) if np.isfinite(freedom) else chdtrc(count, statistic)


def misfit_of(values: np.ndarray, columns: np.ndarray) -> tuple[float, int]:
    """Sum of squares of `values` (m,) that `columns` (m, k) do not explain, and their rank."""
    span = _basis(columns)
    rest = values - span @ (span.T @ values)
    return float(rest @ rest), span.shape[1]


def _basis(columns: np.ndarray) -> np.ndarray:
    """Orthonormal basis (m, r) of columns of any scale."""
    if not columns.size:
        return np.zeros((len(columns), 0))
    sizes = np.linalg.norm(columns, axis=0)
    left, values, _ = np.linalg.svd(columns / np.where(sizes > 0, sizes, 1.0), full_matrices=False)
    return left[:, values > _RANK * max(values[0], 1e-300)]


def seen_change(change: PossibleChange, whitening: np.ndarray, root: np.ndarray) -> SeenChange:
    """A change by the whitening (m, 3 K) of a test, and the Cholesky factor (3 K, 3 K) of the covariance."""
    whole = np.linalg.solve(root, change.columns)
    left = whitening @ change.columns
    share = float(np.linalg.norm(left) / max(np.linalg.norm(whole), 1e-300))
    return SeenChange(change, left, _basis(left), share)
