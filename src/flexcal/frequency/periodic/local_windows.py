"""Windows of neighbouring bins about the bins at which a local polynomial is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ORDER = 2
"""Order of the polynomials in frequency, of response and transient."""


@dataclass(frozen=True, eq=False)
class LocalWindows:
    """L windows of W bins: `index` (L, W) of their bins, `powers` (L, W, 3) of the scaled distance from the bin of each."""

    index: np.ndarray
    powers: np.ndarray

    @classmethod
    def of(cls, at: np.ndarray, bins: int, width: int) -> LocalWindows:
        """Windows about the bins `at` (L,) out of `bins`, `width` bins each; one-sided near the ends."""
        index = np.clip(at - width // 2, 0, bins - width)[:, None] + np.arange(width)
        distance = (index - at[:, None]) / max(width // 2, 1)
        return cls(index, distance[:, :, None] ** np.arange(ORDER + 1))

    def seen(self, values: np.ndarray) -> np.ndarray:
        """Values (R, K, c) of R records restricted to the windows, (L, R, W, c)."""
        return np.moveaxis(values[:, self.index], 0, 1)

    def regressors(self, scaled: np.ndarray) -> np.ndarray:
        """Columns (L, R, W, 3 c) of polynomials times `scaled` (L, R, W, c), the constant ones first."""
        lines, records, width, _ = scaled.shape
        columns = self.powers[:, None, :, :, None] * scaled[:, :, :, None, :]
        return columns.reshape(lines, records, width, -1)

    @property
    def smooth(self) -> np.ndarray:
        """Orthonormal columns (L, 1, W, 3) that span the transient of a record."""
        return np.linalg.qr(self.powers)[0][:, None]


def projected(smooth: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Projection of values (L, R, W, c) onto the span of real orthonormal columns `smooth`."""
    return smooth @ (np.swapaxes(smooth, -1, -2) @ values)
