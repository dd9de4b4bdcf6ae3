"""Averages of R realisations to one frequency response matrix per line.

Wernholt and Moberg 2008 compare them in closed loop, where the torque too is noisy: the logarithmic average is the best,
H1 the worst (its bias is the ratio of torque noise to torque power). That holds here while the scatter of a single
realisation stays below |G|. Where it does not, as at an antiresonance buried in encoder noise, the logarithmic and the
harmonic average are the ones to avoid, and arithmetic, joint input-output and errors-in-variables agree.
"""

from typing import Literal, get_args

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.frequency.periodic.line_spectra import ExperimentSpectra

Average = Literal["arithmetic", "logarithmic", "harmonic", "h1", "joint_input_output", "errors_in_variables"]

_SERIES_RADIUS = (
    0.1  # below this norm the logarithm is a series: no eigenvectors of a matrix that is nearly 1
)
_SERIES_TERMS = 14
_ROUNDING = 1e-10


def average_response(spectra: ExperimentSpectra, realisations: np.ndarray, average: Average) -> np.ndarray:
    """Frequency response (L, n, n) of the named average; `realisations` (R, L, n, n) are those of eq. (20)."""
    match average:
        case "arithmetic":
            return arithmetic(realisations)
        case "logarithmic":
            return logarithmic(realisations)
        case "harmonic":
            return harmonic(realisations)
        case "h1":
            return h1(spectra.outputs, spectra.torque)
        case "joint_input_output":
            return joint_input_output(spectra.outputs, spectra.torque, spectra.excitation)
        case "errors_in_variables":
            return errors_in_variables(spectra.outputs, spectra.torque, spectra.noise)
    raise FlexcalError(
        "E-FRF-008", f"there is no average {average!r}; choose one of {', '.join(get_args(Average))}."
    )


def arithmetic(realisations: np.ndarray) -> np.ndarray:
    """Mean over realisations (R, L, n, n), eq. (21)."""
    return realisations.mean(0)


def harmonic(realisations: np.ndarray) -> np.ndarray:
    """Inverse of the mean inverse of (R, L, n, n): unbiased for noise in the torque alone, as `arithmetic` is for noise in the output
    alone.
    """
    identity = np.broadcast_to(np.eye(realisations.shape[-1]), realisations.shape)
    return np.linalg.solve(np.linalg.solve(realisations, identity).mean(0), identity[0])


def logarithmic(realisations: np.ndarray) -> np.ndarray:
    """Ḡ exp(mean_r log(Ḡ⁻¹ G^[r])) with matrix logarithms; for one axis exp(mean log G), the usual logarithmic average.

    Taken of the matrix and not element by element: it is the same in any basis of axes, and an element near zero keeps
    the accuracy that its place in the matrix gives it, where the mean of log|G_ij| would keep the noise.
    """
    mean = realisations.mean(0)
    return mean @ _matrix_function(_matrix_logarithm(np.linalg.solve(mean, realisations)).mean(0), np.exp)


def h1(acceleration: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """H1 estimate, least squares over all experiments of all realisations, (Σ Q̈ Γᴴ)(Σ Γ Γᴴ)⁻¹; torque noise biases it to zero."""
    dagger = np.swapaxes(torque, -1, -2).conj()
    return right_divide((acceleration @ dagger).sum(0), (torque @ dagger).sum(0))


def joint_input_output(acceleration: np.ndarray, torque: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """Joint input-output estimate (mean Q̈ D⁻¹)(mean Γ D⁻¹)⁻¹ with the known excitation D of each realisation (Pintelon and Schoukens
    2012, §2.7).
    """
    return right_divide(
        right_divide(acceleration, excitation).mean(0), right_divide(torque, excitation).mean(0)
    )


def errors_in_variables(acceleration: np.ndarray, torque: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Maximum likelihood for normal noise of known covariance `noise` (L, 2n, 2n) on every column [Q̈; Γ].

    Whitened by the noise, the columns of all experiments lie near an n-dimensional space: the first n left singular
    vectors (generalised total least squares). Nonlinear distortion is not in `noise`, and not weighed by it.
    """
    columns = np.concatenate([acceleration, torque], -2)  # (R, L, 2n, E)
    columns = np.moveaxis(columns, 0, -1).reshape(*columns.shape[1:3], -1)
    n = noise.shape[-1] // 2
    size = (np.abs(columns) ** 2).mean(-1)
    scale = np.sqrt(np.real(np.diagonal(noise, axis1=1, axis2=2)) + _ROUNDING**2 * size)[..., None]
    # feedback of the position noise alone makes the noise singular: its null directions are taken as nearly exact
    root = scale * np.linalg.cholesky(noise / (scale * np.swapaxes(scale, 1, 2)) + _ROUNDING * np.eye(2 * n))
    directions = np.linalg.svd(np.linalg.solve(root, columns), full_matrices=False)[0][..., :n]
    space = root @ directions
    return right_divide(space[:, :n], space[:, n:])


def right_divide(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """numerator · denominator⁻¹, batched, by a factorisation of the denominator."""
    solved = np.linalg.solve(np.swapaxes(denominator, -1, -2), np.swapaxes(numerator, -1, -2))
    return np.swapaxes(solved, -1, -2)


def _matrix_logarithm(matrix: np.ndarray) -> np.ndarray:
    """Principal logarithm of (…, n, n) matrices near the identity."""
    delta = matrix - np.eye(matrix.shape[-1])
    near = np.linalg.norm(delta, axis=(-2, -1)) < _SERIES_RADIUS
    result = np.empty_like(matrix)
    small = delta[near]
    total, power = np.zeros_like(small), small
    for order in range(1, _SERIES_TERMS + 1):
        total = total + power * ((-1.0) ** (order + 1) / order)
        power = power @ small
    result[near] = total
    if not near.all():
        result[~near] = _matrix_function(matrix[~near], np.log)
    return result


def _matrix_function(matrix: np.ndarray, function: np.ufunc) -> np.ndarray:
    values, vectors = np.linalg.eig(matrix)
    return right_divide(vectors * function(values.astype(complex))[..., None, :], vectors)
