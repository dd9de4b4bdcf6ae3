"""Gaussian process regression; fitted by scikit-learn, evaluated with NumPy and SciPy alone."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexcal.errors import FlexcalError

_SHAPED_BY = 300
"""Largest number of points for fitting lengths and variances, of cubic cost per step."""
_STARTS: tuple[Any, ...] = ((1.0, 1.0, 1.0), (0.1, 3.0, 3.0))
"""Initial lengths, in standard deviations of the inputs: a smooth function, and a ripple along the first input."""
_LENGTHS = (0.03, 100.0)
_SHARES = (1e-6, 100.0)
"""Bounds of the variances relative to the mean square of the values."""
_TOGETHER = 4096
"""Number of points predicted at once."""


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """Gaussian process of three variables, observed at `inputs` (m, 3) as `values` (m,) with a noise of variance `noise`.

    Before it is seen, its mean is zero and its covariance `amplitude` · exp(-½ Σ ((x - x')/lengths)²), `lengths` (3,) in the units of
    the inputs (Rasmussen and Williams 2006, chapter 2).
    """

    inputs: np.ndarray
    values: np.ndarray
    lengths: np.ndarray
    amplitude: float
    noise: float

    @classmethod
    def fitted(cls, inputs: np.ndarray, values: np.ndarray) -> GaussianProcess:
        """Process with the lengths and variances of maximum likelihood for `values` (m,) at `inputs` (m, 3), out of two starts.

        Raises `FlexcalError` without scikit-learn.
        """
        require_scikit_learn()
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

        std, size = np.std(inputs, axis=0), float(np.sqrt(np.mean(values**2)))
        scale = np.where(std > 0, std, 1.0)
        if size == 0:
            return cls(inputs, values, scale, 0.0, 1.0)
        every = -(-len(values) // _SHAPED_BY)
        optima = []
        with warnings.catch_warnings():
            # a length at its bound is no fault: the input does not matter
            warnings.simplefilter("ignore", ConvergenceWarning)
            for start in _STARTS:
                kernel = ConstantKernel(0.5, _SHARES) * RBF(start, _LENGTHS) + WhiteKernel(0.5, _SHARES)
                fit: Any = GaussianProcessRegressor(kernel).fit(
                    inputs[::every] / scale, values[::every] / size
                )
                optima.append((fit.log_marginal_likelihood_value_, fit.kernel_.theta))
        amplitude, *lengths, noise = np.exp(max(optima, key=lambda pair: pair[0])[1]).tolist()
        return cls(inputs, values, scale * lengths, amplitude * size**2, noise * size**2)

    def predict(self, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean of the function (N,) and standard deviation (N,) of a value, noise included, at `inputs` (N, 3)."""
        from scipy.linalg import solve_triangular

        factor, weights = self._solution
        means, variances = [np.zeros(0)], [np.zeros(0)]
        for start in range(0, len(inputs), _TOGETHER):
            near = self._covariance(inputs[start : start + _TOGETHER])
            taken = solve_triangular(factor, near.T, lower=True)
            means.append(near @ weights)
            variances.append(self.amplitude + self.noise - np.sum(taken**2, axis=0))
        return np.concatenate(means), np.sqrt(np.maximum(np.concatenate(variances), self.noise))

    @cached_property
    def _solution(self) -> tuple[np.ndarray, np.ndarray]:
        """Cholesky factor L of the covariance of the values, and the weights of the means."""
        from scipy.linalg import cho_factor, cho_solve

        covariance = self._covariance(self.inputs) + self.noise * np.eye(len(self.inputs))
        factor, _ = cho_factor(covariance, lower=True)
        return factor, cho_solve((factor, True), self.values)

    def _covariance(self, inputs: np.ndarray) -> np.ndarray:
        """Covariance (N, m) between points (N, 3) and the observed ones."""
        left, right = inputs / self.lengths, self.inputs / self.lengths
        squares = np.sum(left**2, axis=1)[:, None] + np.sum(right**2, axis=1) - 2.0 * left @ right.T
        return self.amplitude * np.exp(-0.5 * np.maximum(squares, 0.0))


def require_scikit_learn() -> None:
    """Raise `FlexcalError` if scikit-learn is not installed."""
    from importlib.util import find_spec

    if find_spec("sklearn") is None:
        raise FlexcalError(
            "E-DYN-027",
            "scikit-learn is not installed, and a learned residual torque needs it; install it with 'pip install scikit-learn' "
            "(flexcal's extra 'learn').",
        )
