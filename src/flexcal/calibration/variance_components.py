"""Variance components of the errors of measured points, by restricted maximum likelihood (Patterson & Thompson 1971)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.scatter import ErrorCells, Scatter

_CLEAR_GAIN = 3.0
"""Gain in log-likelihood from which a stated sigma counts as too large (p = 0.01, one parameter at its bound)."""
_SUPPORTED = 2.7
"""Gain in log-likelihood by which a component counts as found (p = 0.01, one variance at its bound of zero)."""
_LARGEST = 30.0
"""Variance over that about the fit, which no component exceeds."""
_NEGLIGIBLE = 1e-4
"""Share of the total variance below which a component is zero."""


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A fit linearised at its solution: `residual` (N, 3) m = `free` x + `tied` z + error, z standard normal a priori.

    `free` (N, 3, p) and `tied` (N, 3, t) m; `sigma` (N, 3) m as stated, `turns` (N, 3, r) m/rad; `cells` are the labels (N,) of blocks with
    a common model error, for workspace, order and command, None where there are none.
    """

    residual: np.ndarray
    free: np.ndarray
    tied: np.ndarray
    sigma: np.ndarray
    turns: np.ndarray
    cells: ErrorCells

    def projected(self, scatter: Scatter, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whitened residual (m,) and further `columns` (N, 3, k) as (m, k), without what parameters and shared errors explain.

        Their scalar products are those under the marginal covariance of the residual, the `tied` numbers integrated out.
        """
        whitening = np.linalg.inv(np.linalg.cholesky(scatter.independent(self.sigma, self.turns)))
        tied = np.concatenate([self.tied, scatter.shared(self.cells, len(self.residual))], axis=2)
        both = np.concatenate([self.free, tied, self.residual[:, :, None], columns], axis=2)
        size, count = self.free.shape[2], tied.shape[2]
        white = np.matmul(whitening, both).reshape(3 * len(both), both.shape[2])
        prior = np.zeros((count, both.shape[2]))
        prior[:, size : size + count] = np.eye(count)
        stacked = np.vstack([white, prior])
        basis = np.linalg.qr(stacked[:, : size + count])[0]
        left = stacked[:, size + count :] - basis @ (basis.T @ stacked[:, size + count :])
        return left[:, 0], left[:, 1:]

    def scatter(self, *, stated: bool) -> tuple[Scatter, dict[str, float]]:
        """The components, and the standard deviation of each of them that is not zero.

        Where a sigma is `stated`, the instrument's part is that, or less where the points scatter clearly less than it says.
        """
        names = ["robot", "angular"]
        names += [
            name
            for name, cell in zip(("workspace", "order", "command"), self.cells, strict=True)
            if cell is not None
        ]
        total = self._mean_square()
        lever = float(np.mean(self.turns**2)) * max(self.turns.shape[2], 1) or 1.0
        scale = np.array([total / lever if name == "angular" else total for name in names])
        share = 1.0 if stated else 0.0
        variances, likelihood = self._maximum(names, scale, share)
        stated_square = float(np.mean(self.sigma**2))
        if stated and total < stated_square:
            # the points scatter less than the instrument alone should: its sigma may be too large
            sizes = np.append(scale[2:], total / stated_square)
            alone = self._maximum([*names[2:], "share"], sizes, None)[1]
            if alone - likelihood > _CLEAR_GAIN:
                names = ["robot", *names[2:]]
                scale = np.append(scale[0], scale[2:])
                sizes = np.append(scale, total / stated_square)
                narrower, likelihood = self._maximum([*names, "share"], sizes, None)
                variances, share = narrower[:-1], float(np.sqrt(narrower[-1]))
        names, scale, variances = self._supported(names, scale, variances, likelihood, share)
        variances = np.where(variances > _NEGLIGIBLE * scale, variances, 0.0)
        stds = dict(zip(names, np.sqrt(variances).tolist(), strict=True))
        found = Scatter(share=share, **stds)
        return found, self._uncertainties(names, variances, share)

    def _supported(
        self, names: list[str], scale: np.ndarray, variances: np.ndarray, likelihood: float, share: float
    ) -> tuple[list[str], np.ndarray, np.ndarray]:
        """The components that the data support: the others are taken out one by one while that costs no more than chance gains."""
        seen = [k for k in range(len(names)) if k == 0 or variances[k] > _NEGLIGIBLE * scale[k]]
        names, scale, variances = [names[k] for k in seen], scale[seen], variances[seen]
        while len(names) > 1:
            trials = []
            for k in range(1, len(names)):
                rest = [i for i in range(len(names)) if i != k]
                near = variances[rest] / scale[rest]
                near[0] += variances[k] / scale[k] / 2
                found = self._maximum([names[i] for i in rest], scale[rest], share, near)
                trials.append((found[1], found[0], rest))
            best, kept, rest = max(trials, key=lambda trial: trial[0])
            if likelihood - best > _SUPPORTED:
                break
            names, scale, variances, likelihood = [names[i] for i in rest], scale[rest], kept, best
        return names, scale, variances

    def _mean_square(self) -> float:
        """Variance of a coordinate about the fit, m²; the parameters take their degrees of freedom."""
        rows, size = self.residual.size, self.free.shape[2]
        basis = np.linalg.qr(self.free.reshape(rows, size))[0]
        left = self.residual.ravel() - basis @ (basis.T @ self.residual.ravel())
        return float(left @ left) / max(rows - size, 1) + 1e-24

    def _maximum(
        self, names: list[str], scale: np.ndarray, share: float | None, near: np.ndarray | None = None
    ) -> tuple[np.ndarray, float]:
        """Variances (k,) of the greatest restricted likelihood, and its logarithm; `share` None: it is the last of the variances.

        `near` (k,) is where to begin, in units of `scale`.
        """
        from scipy.optimize import minimize

        def objective(x: np.ndarray) -> tuple[float, np.ndarray]:
            value, slope = self._deviance(names, x * scale, share)
            return value, slope * scale

        start = np.full(len(names), 0.7 / len(names)) if near is None else np.clip(near, 1e-9, _LARGEST)
        bounds = [(1e-9, _LARGEST)] * len(names)
        if share is None:
            start[-1], bounds[-1] = 0.5, (1e-6, min(1.0 / float(scale[-1]), _LARGEST))
        found = minimize(
            objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 100}
        )
        return found.x * scale, -0.5 * float(found.fun)

    def _deviance(
        self, names: list[str], variances: np.ndarray, share: float | None
    ) -> tuple[float, np.ndarray]:
        """-2 log restricted likelihood and its derivatives by the variances (k,)."""
        at = self._at(names, variances, share)
        slopes = [at.trace(name) - at.square(name) for name in names]
        return at.deviance, np.array(slopes)

    def _at(self, names: list[str], variances: np.ndarray, share: float | None) -> _Likelihood:
        known = dict(zip(names, variances.tolist(), strict=True))
        squared = known.get("share", 0.0) if share is None else share**2
        stds = {name: float(np.sqrt(value)) for name, value in known.items() if name != "share"}
        return _Likelihood.of(self, Scatter(share=float(np.sqrt(squared)), **stds))

    def _uncertainties(self, names: list[str], variances: np.ndarray, share: float) -> dict[str, float]:
        """Standard deviations of the components, from the average information (Gilmour, Thompson & Cullis 1995)."""
        seen = [name for name, value in zip(names, variances, strict=True) if value > 0]
        if not seen:
            return {}
        at = self._at(names, variances, share)
        pushed = [at.applied(at.component(name)(at.weighted)) for name in seen]
        raw = [at.component(name)(at.weighted) for name in seen]
        information = 0.5 * np.array([[float(np.sum(a * b)) for b in pushed] for a in raw])
        spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(information)), 0.0))
        values = dict(zip(names, variances.tolist(), strict=True))
        return {name: float(s / (2 * np.sqrt(values[name]))) for name, s in zip(seen, spread, strict=True)}


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """Restricted likelihood at some components: P = V⁻¹ - V⁻¹X(XᵀV⁻¹X)⁻¹XᵀV⁻¹ by its blocks.

    `whitening` (N, 3, 3); `reduced` (N, q, 3): C with P_ij = δ_ij WᵀW - C_iᵀ C_j; `weighted` (N, 3): P y.
    """

    fit: LinearFit
    whitening: np.ndarray
    reduced: np.ndarray
    weighted: np.ndarray
    deviance: float

    @classmethod
    def of(cls, fit: LinearFit, scatter: Scatter) -> _Likelihood:
        from scipy.linalg import solve_triangular

        factor = np.linalg.cholesky(scatter.independent(fit.sigma, fit.turns))
        whitening = np.linalg.inv(factor)
        free = fit.free.shape[2]
        columns = np.concatenate([fit.free, fit.tied, scatter.shared(fit.cells, len(fit.residual))], axis=2)
        size = columns.shape[2]
        white = np.matmul(whitening, columns).reshape(-1, size)
        gram = white.T @ white
        gram[range(free, size), range(free, size)] += 1.0
        upper = np.linalg.cholesky(gram).T
        basis = solve_triangular(upper.T, white.T, lower=True).T
        observed = np.matmul(whitening, fit.residual[:, :, None]).reshape(-1)
        along = basis.T @ observed
        left = observed - basis @ along
        weighted = np.matmul(np.swapaxes(whitening, 1, 2), left.reshape(-1, 3, 1))[:, :, 0]
        diagonals = np.diagonal(factor, axis1=1, axis2=2)
        deviance = 2 * float(np.log(diagonals).sum()) + 2 * float(np.log(np.diag(upper)).sum())
        deviance += float(observed @ observed - along @ along)
        reduced = np.matmul(np.swapaxes(basis.reshape(-1, 3, size), 1, 2), whitening)
        return cls(fit, whitening, reduced, weighted, deviance)

    def component(self, name: str) -> Callable[[np.ndarray], np.ndarray]:
        """The derivative of the covariance by one variance, as what it makes of errors (N, 3)."""
        fit = self.fit
        if name == "robot":
            return lambda e: e
        if name == "share":
            return lambda e: fit.sigma**2 * e
        if name == "angular":
            return lambda e: np.einsum("nij,nkj,nk->ni", fit.turns, fit.turns, e)
        labels = self._labels(name)
        return lambda e: _sums(labels, e)[np.unique(labels, return_inverse=True)[1]]

    def square(self, name: str) -> float:
        """yᵀ P V' P y of one component V'."""
        return float(np.sum(self.weighted * self.component(name)(self.weighted)))

    def trace(self, name: str) -> float:
        """tr(P V') of one component V'."""
        if name in ("workspace", "order", "command"):
            labels = self._labels(name)
            inverse = float(np.sum(self.whitening**2))
            return inverse - float(np.sum(_sums(labels, self.reduced) ** 2))
        if name == "angular":
            turned = np.matmul(self.whitening, self.fit.turns), np.matmul(self.reduced, self.fit.turns)
            return float(np.sum(turned[0] ** 2) - np.sum(turned[1] ** 2))
        scale = self.fit.sigma[:, None] if name == "share" else 1.0
        return float(np.sum((self.whitening * scale) ** 2) - np.sum((self.reduced * scale) ** 2))

    def applied(self, errors: np.ndarray) -> np.ndarray:
        """P times errors (N, 3)."""
        white = np.matmul(self.whitening, errors[:, :, None])
        plain = np.matmul(np.swapaxes(self.whitening, 1, 2), white)[:, :, 0]
        along = np.einsum("nqi,ni->q", self.reduced, errors)
        return plain - np.einsum("nqi,q->ni", self.reduced, along)

    def _labels(self, name: str) -> np.ndarray:
        labels = self.fit.cells[("workspace", "order", "command").index(name)]
        assert labels is not None
        return labels


def _sums(labels: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sums of `rows` (N, …) over each block, (K, …)."""
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=labels[order][0] - 1))
    return np.add.reduceat(rows[order], starts, axis=0)
