"""Modal model of a frequency response: common poles, a delay, and free numerators."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

BACKGROUND = 4
"""Number of terms besides the modes: modes below the band 1/x², friction 1/(x + β), mass 1, and modes above the band x²."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modal model G(jω) e^{jωϑ} = c_0/x² + c_1/(x + β) + c_2 + c_3 x² + Σ_m (a_m + b_m x)/(x² + 2 ζ_m f_m x + f_m²), per output and input.

    x = jω/`highest` (rad/s). `natural` (M,): f_m, relative to `highest`; `damping` (M,): ζ_m; `slow`: β; `delay` ϑ in s; `numerators`
    (n_y, n_u, 4 + 2M): c, then a_m, b_m of every mode.
    """

    highest: float
    natural: np.ndarray
    damping: np.ndarray
    slow: float
    delay: float
    numerators: np.ndarray

    @property
    def frequencies_hz(self) -> np.ndarray:
        """Natural frequencies (M,)."""
        return self.natural * self.highest / (2 * np.pi)

    @property
    def quadratics(self) -> np.ndarray:
        """Coefficients (M, 2) c_1, c_0 of the denominators x² + c_1 x + c_0."""
        return quadratics(self.natural, self.damping)

    def response(self, frequencies_hz: np.ndarray) -> np.ndarray:
        """G (L, n_y, n_u), delay included."""
        x = 2j * np.pi * np.asarray(frequencies_hz) / self.highest
        shapes = np.einsum("kt,yut->kyu", response_basis(x, self.slow, self.quadratics), self.numerators)
        return shapes * np.exp(-x * self.highest * self.delay)[:, None, None]

    def zeros(self, output: int, input: int) -> np.ndarray:
        """Zeros of one element in the upper half plane, rad/s, by increasing magnitude; the delay adds none."""
        c = self.numerators[output, input]
        factors = [[1.0, 0.0, 0.0], [1.0, self.slow], *([1.0, c1, c0] for c1, c0 in self.quadratics)]
        above = [[c[0]], [c[1]], *c[BACKGROUND:].reshape(-1, 2)[:, ::-1]]
        total = reduce(np.polymul, factors, np.array([c[3], 0.0, c[2]]))
        for k, numerator in enumerate(above):
            others = [factor for other, factor in enumerate(factors) if other != k]
            total = np.polyadd(total, reduce(np.polymul, others, np.array(numerator)))
        roots = np.roots(total) * self.highest
        roots = roots[roots.imag > 1e-9 * self.highest]
        return roots[np.argsort(np.abs(roots))]


def quadratics(natural: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Coefficients (M, 2) c_1, c_0 of x² + c_1 x + c_0."""
    return np.stack([2 * damping * natural, natural**2], -1).reshape(-1, 2)


def response_basis(x: np.ndarray, slow: float, of: np.ndarray) -> np.ndarray:
    """Basis functions (K, 4 + 2M): 1/x², 1/(x + `slow`), 1, x², and the two terms of every mode."""
    modes = [v / (x**2 + c1 * x + c0) for c1, c0 in of for v in (np.ones_like(x), x)]
    return np.stack([1 / x**2, 1 / (x + slow), np.ones_like(x), x**2, *modes], -1)
