"""Covariance of measured frequency response matrices: noise from empty bins, total from the scatter of realisations.

vec() stacks columns throughout: element (i, j) of G is entry j·n_y + i. Covariances are E[δ δᴴ] of complex, circular δ.
"""

import numpy as np

from flexcal.kernels import scatter_covariance

_SMALLEST_RELATIVE_STD = (
    1e-10  # no entry of a covariance is claimed to be known better: rounding is not noise
)


def vec(matrices: np.ndarray) -> np.ndarray:
    """Matrices (L, m, n) vectorised column by column, (L, m n)."""
    return np.swapaxes(matrices, -1, -2).reshape(len(matrices), -1)


def pool_noise(squares: np.ndarray, bins: np.ndarray, at: np.ndarray, count: int) -> np.ndarray:
    """Means (L, …) of `squares` (B, …) over the `count` successive bins around each of the positions `at` (L,).

    `bins` is sorted; near the ends the window keeps its size and leans inwards. O(B) for any window.
    """
    count = min(count, bins.size)
    start = _window_start(np.searchsorted(bins, at), bins.size, count)
    running = np.empty((bins.size + 1, *squares.shape[1:]), squares.dtype)
    running[0] = 0.0
    np.cumsum(squares, axis=0, out=running[1:])
    pooled = running[start + count]
    pooled -= running[start]
    pooled *= 1.0 / count  # a complex division takes ten times as long
    return pooled


def _window_start(nearest: np.ndarray, size: int, count: int) -> np.ndarray:
    return np.clip(nearest - count // 2, 0, size - count)


def column_noise(empty: np.ndarray, bins: np.ndarray, lines: np.ndarray, count: int) -> np.ndarray:
    """Noise covariance (L, c, c) of one measured column from spectra (B, S, c) of S records at B empty bins.

    Pooled over the `count` bins around each line and over the records; the spectra are those of position and torque,
    whose noise is smoother over frequency than that of the acceleration.
    """
    squares = np.swapaxes(empty, 1, 2) @ empty.conj() * (1.0 / empty.shape[1])
    return pool_noise(squares, bins, lines, count)


def output_noise(response: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Covariance (L, m, m) of the equation error N_y - G N_u of one experiment, from that of [N_y; N_u], (L, m + n, m + n)."""
    lines, m, _ = response.shape
    left = np.concatenate([np.broadcast_to(np.eye(m), (lines, m, m)), -response], -1)
    return left @ column @ _dagger(left)


def input_gain(inverse: np.ndarray) -> np.ndarray:
    """Right factor (L, n, n) of the covariance of vec G: the mean over realisations of conj((Γ Γᴴ)⁻¹), from Γ⁻¹ (R, L, n, n).

    From δG = (δQ̈ - G δΓ) Γ⁻¹ with the same noise, independent, in every experiment:
    cov(vec G) = conj((Γ Γᴴ)⁻¹) ⊗ cov(N_y - G N_u).
    """
    gain = (np.swapaxes(inverse, -1, -2) @ inverse.conj()).mean(0)
    return 0.5 * (gain + _dagger(gain))


def kronecker(right: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Batched Kronecker product right ⊗ left of (L, n, n) and (L, m, m) matrices, (L, n m, n m)."""
    lines, n, m = right.shape[0], right.shape[-1], left.shape[-1]
    product = np.repeat(right, m, axis=-1)[:, :, None] * np.tile(left, n)[:, None]
    return product.reshape(lines, n * m, n * m)


def total_covariance(
    realisations: np.ndarray, response: np.ndarray, noise: np.ndarray, gain: np.ndarray, count: int
) -> tuple[np.ndarray, float]:
    """Covariance (L, m n, m n) of vec of the mean of the R realisations, noise and nonlinear distortion, and its degrees of freedom.

    The first n of the m rows of G are those of the n driven axes.
    The scatter G^[r] - mean (R, L, m, n) has no structure over frequency but the gain of the plant itself, so it is
    pooled over `count` neighbouring lines after whitening by that gain: from the left by L with
    L Lᴴ = G Θ Gᴴ + `noise`, where Θ is the (diagonal) input-referred disturbance found in the window, friction above
    all, and `noise` (L, n, n) the equation error of output_noise; from the right by P with P Pᴴ = `gain`. Poles and
    zeros stay as sharp as they are in G. In the whitened coordinates the pooled covariance of p = m n elements is shrunk to its
    diagonal (Ledoit and Wolf; for complex normal scatter, Schäfer and Strimmer 2005), then carried back: the intensity
    min(1, Σ var(s_ij) / Σ |s_ij|²) over i ≠ j, with var(s_ij) = s_ii s_jj / freedom, leaves a true correlation alone and removes what
    chance alone would give; the result is positive definite where the diagonal is.
    Degrees of freedom: (R - 1) · count, before shrinkage.
    """
    members, lines, m, n = realisations.shape
    count = min(count, lines)
    at = np.arange(lines)
    scatter = (realisations - realisations.mean(0)) * np.sqrt(members / (members - 1.0))
    right = np.linalg.cholesky(gain)
    # all members in one system a line: (L, n, R m), then (L, m, R n)
    balanced = np.linalg.inv(right) @ scatter.transpose(1, 3, 0, 2).reshape(lines, n, -1)
    balanced = balanced.reshape(lines, n, members, m).transpose(0, 3, 2, 1).reshape(lines, m, -1)

    driven = response[:, :n]
    inverse = np.linalg.inv(driven)
    input_scatter = inverse @ balanced[:, :n]
    input_noise = inverse @ noise[:, :n, :n] @ _dagger(inverse)
    significant = 1.0 + 2.0 / np.sqrt((members - 1) * count)  # what the noise may well explain shapes nothing
    disturbance = (np.abs(input_scatter) ** 2).mean(-1) - significant * _diagonal(input_noise)
    disturbance = np.maximum(pool_noise(disturbance, at, at, count), 0.0)

    size = np.linalg.norm(response, axis=2)
    size[:, :n] = np.linalg.norm(driven, axis=(1, 2))[:, None]  # axes have one unit, sensors their own
    shape = (response * disturbance[:, None, :]) @ _dagger(response) + noise
    shape = shape + (_SMALLEST_RELATIVE_STD * size)[:, :, None] ** 2 * np.eye(m)
    left = np.linalg.cholesky(0.5 * (shape + _dagger(shape)))

    white = (np.linalg.inv(left) @ balanced).reshape(lines, m, members, n)
    freedom = float((members - 1) * count)
    total = np.empty((lines, n * m, n * m), complex)
    scatter_covariance(
        _parts(white), _parts(right / np.sqrt(members)), _parts(left), count, freedom, _parts(total)
    )
    return total, freedom


def _parts(values: np.ndarray) -> np.ndarray:
    """Real and imaginary parts (…, 2) of complex numbers, as the kernels take them."""
    return np.ascontiguousarray(values).view(float).reshape(*values.shape, 2)


def _dagger(matrix: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrix, -1, -2).conj()


def _diagonal(matrix: np.ndarray) -> np.ndarray:
    return np.real(np.diagonal(matrix, axis1=-2, axis2=-1)).copy()
