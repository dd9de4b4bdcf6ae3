"""Chain of masses stepped exactly under a held torque, with optional feedback; shares nothing with the package."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

INERTIAS, STIFFNESSES, DAMPINGS, VISCOUS = (2.0, 1.0, 3.0), (20e3, 9e3), (8.0, 6.0), 5.0
STEP = 1e-3


class Axis:
    """Masses in a row; the torque acts on the first, which viscous friction brakes."""

    def __init__(
        self, inertias=INERTIAS, stiffnesses=STIFFNESSES, dampings=DAMPINGS, viscous=VISCOUS
    ) -> None:
        n = len(inertias)
        k, d = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n - 1):
            edge = np.eye(n)[i] - np.eye(n)[i + 1]
            k += stiffnesses[i] * np.outer(edge, edge)
            d += dampings[i] * np.outer(edge, edge)
        d[0, 0] += viscous
        self.n, self.m, self.k, self.d = n, np.diag(inertias), k, d

    def _frequencies(self, kept: slice) -> tuple[np.ndarray, np.ndarray]:
        m, k, d = (a[kept, kept] for a in (self.m, self.k, self.d))
        inverse, n = np.linalg.inv(m), len(m)
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ d]])
        found = np.linalg.eigvals(state)
        found = found[found.imag > 1e-3]
        found = found[np.argsort(abs(found))]
        return abs(found) / (2 * np.pi), -found.real / abs(found)

    @property
    def resonances(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural frequencies (Hz) and damping ratios."""
        return self._frequencies(slice(0, None))

    @property
    def antiresonances(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the first mass: those of the rest with it held."""
        return self._frequencies(slice(1, None))

    def response(self, frequencies_hz: np.ndarray) -> np.ndarray:
        """Accelerations of all masses for the torque (L, n)."""
        s = 2j * np.pi * frequencies_hz[:, None, None]
        return (s**2 * np.linalg.inv(self.m * s**2 + self.d * s + self.k))[:, :, 0]

    def run(
        self,
        torque: np.ndarray,
        *,
        noise: np.ndarray | None = None,
        gains: tuple[float, float] = (0.0, 0.0),
        step: float = STEP,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The torque that acted (N,) and the measured positions (N, n), with `noise` on the first, which PD `gains` feed back."""
        n = 2 * self.n
        whole = np.zeros((n + 1, n + 1))
        inverse = np.linalg.inv(self.m)
        whole[: self.n, self.n : n] = np.eye(self.n)
        whole[self.n : n, : self.n], whole[self.n : n, self.n : n] = -inverse @ self.k, -inverse @ self.d
        whole[self.n : n, n] = inverse[:, 0]
        stepped = expm(whole * step)
        a, b = stepped[:n, :n], stepped[:n, n]
        x, before = np.zeros(n), 0.0
        acted, positions = np.zeros(len(torque)), np.zeros((len(torque), self.n))
        for i, u in enumerate(torque):
            seen = x[: self.n].copy()
            if noise is not None:
                seen[0] += noise[i]
            u = u - gains[0] * seen[0] - gains[1] * (seen[0] - before) / step
            before = seen[0]
            acted[i], positions[i] = u, seen
            x = a @ x + b * u
        return acted, positions


def chirp(samples: int, low: float, high: float, amplitude: float, step: float = STEP) -> np.ndarray:
    """A linear swept sine."""
    t = step * np.arange(samples)
    return amplitude * np.sin(2 * np.pi * (low * t + (high - low) * t**2 / (2 * samples * step)))


def multisine(period: int, lines: range, generator: np.random.Generator, step: float = STEP) -> np.ndarray:
    """One period of random phases."""
    t = np.arange(period) / period
    phases = generator.uniform(0, 2 * np.pi, len(lines))
    waves = (np.cos(2 * np.pi * k * t + phase) for k, phase in zip(lines, phases, strict=True))
    return sum(waves, start=np.zeros(period))
