"""Whitened real residual of predicted and measured frequency responses (Eqs. 26, 27)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.elasticity.response_model.prediction import PredictedMeasurements, ResponseModel
from flexcal.elasticity.response_model.weighting import CovarianceWeighting, Weighting
from flexcal.frequency.periodic import FrequencyResponse, vec

LOGARITHM_LIMIT = 0.1
"""Largest relative standard deviation of an element for a logarithmic error; near a zero log Ĝ is biased."""

LOGARITHM_CURVATURE = 0.3
"""Largest second-order term of a logarithm, Δ²/2 at one standard deviation, relative to the conditional accuracy of the element given
the others: a sensor's reading may be known from the motors to a thousandth though friction scatters both by a twentieth.
"""

CLUSTER_LINES = 4
"""Neighbouring lines of one pose in one cluster of the sandwich covariance."""


@dataclass(frozen=True, eq=False)
class PoseResidual:
    """Residual of the measured response of one pose (L lines, m outputs: n axes, then sensors).

    `logarithmic` (L, m, n) tells the elements whose error is log(Ĝ/G); the error of the others is (Ĝ - G)/`scale`, with scale
    √|Ĝ_ii Ĝ_jj| so that a coupling near zero counts as what it is beside its axes, and for a sensor the size of its row. `factor`
    (L, m n, m n) weights vec of the errors, of `covariance` (L, m n, m n). `shift` (L, m, n) is added to every prediction.
    """

    measured: np.ndarray
    logarithmic: np.ndarray
    scale: np.ndarray
    factor: np.ndarray
    covariance: np.ndarray
    shift: np.ndarray | float = 0.0

    @classmethod
    def of(cls, response: FrequencyResponse, weighting: Weighting) -> PoseResidual:
        """Residual with logarithmic or linear errors chosen by their standard deviation, whatever their weights."""
        measured = response.stacked
        scale = element_scale(measured)
        relative = response.stacked_std / np.maximum(np.abs(measured), np.finfo(float).tiny)
        small = relative < LOGARITHM_LIMIT
        assumed = _covariance(response, measured, scale, small)
        apart = 1.0 / np.linalg.norm(CovarianceWeighting().factor(response, assumed), axis=1)
        logarithmic = small & (vec(relative) ** 2 / 2 < LOGARITHM_CURVATURE * apart).reshape(
            len(measured), measured.shape[2], -1
        ).swapaxes(1, 2)
        covariance = _covariance(response, measured, scale, logarithmic)
        return cls(measured, logarithmic, scale, weighting.factor(response, covariance), covariance)

    def errors(self, predicted: np.ndarray) -> np.ndarray:
        """Complex errors Δ (L, m, n); the phase of a logarithm is in (-π, π] as it is that of the ratio."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(np.where(self.logarithmic, self.measured / predicted, 1.0))
        return np.where(self.logarithmic, ratio, (self.measured - predicted) / self.scale)

    def residual(self, predicted: np.ndarray) -> np.ndarray:
        """Whitened rows (2 L m n,), line by line: real parts, then imaginary parts."""
        white = self.factor @ vec(self.errors(predicted + self.shift))[:, :, None]
        return _real(white)[:, 0]

    def jacobian(self, prediction: PredictedMeasurements) -> np.ndarray:
        """∂(residual)/∂x (2 L m n, c) by the parameters of `prediction.columns`."""
        unit = np.where(self.logarithmic, prediction.response + self.shift, self.scale)
        change = prediction.derivatives / -unit[..., None]
        lines, m, n, columns = change.shape
        return _real(self.factor @ np.swapaxes(change, 1, 2).reshape(lines, m * n, columns))

    def by_noise(self, rows: np.ndarray) -> np.ndarray:
        """Nᵀ `rows` (2 L m n, c) of the weighted residual with the covariance N Nᵀ, 1 where the weights are its inverse."""
        root = self.factor @ np.linalg.cholesky(self.covariance)
        real, imaginary = np.split(rows.reshape(len(root), -1, rows.shape[-1]), 2, axis=1)
        spread = np.swapaxes(root.conj(), 1, 2) @ (real + 1j * imaginary)
        return _real(spread) / np.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class ResponseResidual:
    """Residual of all poses as a function of the estimation coordinates."""

    model: ResponseModel
    poses: tuple[PoseResidual, ...]

    @classmethod
    def of(
        cls, model: ResponseModel, responses: Sequence[FrequencyResponse], weighting: Weighting
    ) -> ResponseResidual:
        """Residual for measured responses, in the order of the model's poses."""
        return cls(model, tuple(PoseResidual.of(response, weighting) for response in responses))

    def shifted(self, model: ResponseModel, shifts: Sequence[np.ndarray]) -> ResponseResidual:
        """Residual against `model`, with known changes (L, m, n) added to its prediction in every pose."""
        poses = [replace(pose, shift=shift) for pose, shift in zip(self.poses, shifts, strict=True)]
        return ResponseResidual(model, tuple(poses))

    def residual(self, x: np.ndarray) -> np.ndarray:
        """All rows (m,), pose by pose."""
        predicted = self.model.responses(x)
        return np.concatenate([pose.residual(g) for pose, g in zip(self.poses, predicted, strict=True)])

    def linearise(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All rows (m,) and their derivatives (m, p)."""
        predictions = self.model.predict(x)
        residuals, start = [], 0
        rows = [2 * pose.measured.size for pose in self.poses]
        jacobian = np.zeros((sum(rows), len(self.model.parameters)))
        for pose, prediction, count in zip(self.poses, predictions, rows, strict=True):
            residuals.append(pose.residual(prediction.response))
            jacobian[start : start + count, prediction.columns] = pose.jacobian(prediction)
            start += count
        return np.concatenate(residuals), jacobian

    def by_noise(self, rows: np.ndarray) -> np.ndarray:
        """Nᵀ `rows` (m, c), with N Nᵀ (m, m) the covariance of the weighted residual by that of the responses."""
        ends = np.cumsum([2 * pose.measured.size for pose in self.poses])
        return np.concatenate(
            [pose.by_noise(part) for pose, part in zip(self.poses, np.split(rows, ends[:-1]), strict=True)]
        )

    def clusters(self, lines: int = CLUSTER_LINES) -> np.ndarray:
        """Cluster number (m,) of every row: `lines` neighbouring lines of one pose."""
        labels, first = [], 0
        for pose in self.poses:
            number = np.arange(len(pose.measured)) // lines
            labels.append(first + np.repeat(number, 2 * pose.measured[0].size))
            first += int(number[-1]) + 1
        return np.concatenate(labels)


def element_scale(stacked: np.ndarray) -> np.ndarray:
    """Reference size (L, m, n) of each element of a response (L, m, n): √|G_ii G_jj| of the n axes; for a sensor the size of its row."""
    axes = stacked.shape[2]
    diagonal = np.abs(np.diagonal(stacked[:, :axes], axis1=1, axis2=2))
    scale = np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
    rows = np.linalg.norm(stacked[:, axes:], axis=2, keepdims=True)
    return np.concatenate([scale, np.repeat(rows, axes, axis=2)], axis=1)


def _covariance(
    response: FrequencyResponse, measured: np.ndarray, scale: np.ndarray, logarithmic: np.ndarray
) -> np.ndarray:
    """Covariance (L, m n, m n) of the errors, of which some are logarithms."""
    unit = vec(np.where(logarithmic, measured, scale))
    return response.stacked_covariance / (unit[:, :, None] * unit[:, None, :].conj())


def _real(white: np.ndarray) -> np.ndarray:
    """Real rows (2 L k, c) of unit variance from complex (L, k, c): √2 times real and imaginary part of each line."""
    both = np.sqrt(2.0) * np.concatenate([np.real(white), np.imag(white)], axis=1)
    return both.reshape(-1, white.shape[-1])
