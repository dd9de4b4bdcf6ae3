"""Chain of masses joined by springs and dampers and driven at the first one, as a model of an axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class MassChain:
    """Inertias J (N,), stiffnesses k and dampings d (N - 1,) between neighbours, viscous friction b of the first, and a delay (s).

    Units follow those of the input and the output; in N m and rad they are kg m², N m/rad and N m s/rad.
    """

    inertias: np.ndarray
    stiffnesses: np.ndarray
    dampings: np.ndarray
    viscous: float
    delay: float = 0.0

    def response(self, frequencies_hz: np.ndarray) -> np.ndarray:
        """Acceleration of the first mass for a torque on it (L,), delay included.

        s²/Z_1 with Z_i = J_i s² + 1/(1/(k_i + d_i s) + 1/Z_{i+1}), and b s more in Z_1.
        """
        s = 2j * np.pi * np.asarray(frequencies_hz)
        load = self.inertias[-1] * s**2
        for inertia, stiffness, damping in zip(
            self.inertias[-2::-1], self.stiffnesses[::-1], self.dampings[::-1], strict=True
        ):
            joint = stiffness + damping * s
            load = inertia * s**2 + joint * load / (joint + load)
        return s**2 / (load + self.viscous * s) * np.exp(-s * self.delay)

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues (2N,) rad/s."""
        count = len(self.inertias)
        stiffness, damping = (self._laplacian(values) for values in (self.stiffnesses, self.dampings))
        damping[0, 0] += self.viscous
        state = np.zeros((2 * count, 2 * count))
        state[:count, count:] = np.eye(count)
        state[count:, :count] = -stiffness / self.inertias[:, None]
        state[count:, count:] = -damping / self.inertias[:, None]
        return np.linalg.eigvals(state)

    def _laplacian(self, values: np.ndarray) -> np.ndarray:
        count = len(self.inertias)
        result = np.zeros((count, count))
        for k, value in enumerate(values):
            result[k : k + 2, k : k + 2] += value * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return result


def synthesise(first: float, resonances: Sequence[float], antiresonances: Sequence[float]) -> MassChain:
    """Undamped chain with these resonances and antiresonances (rad/s) and the first inertia `first`, by continued fractions (Cauer).

    An antiresonance must lie below each resonance and above the one before; otherwise some inertia comes out negative.
    """
    numerator = np.poly([-(w**2) for w in resonances]) * first
    denominator = np.poly([-(w**2) for w in antiresonances])
    inertias, stiffnesses = [], []
    for _ in resonances:
        inertia = numerator[0] / denominator[0]
        rest = (numerator - inertia * denominator)[1:]  # Z - J λ = λ rest / denominator
        stiffness = rest[0] / denominator[0]
        inertias.append(inertia)
        stiffnesses.append(stiffness)
        remainder = denominator - np.append(rest, 0.0) / stiffness
        numerator, denominator = rest, remainder[1:]
    inertias.append(numerator[0] / denominator[0])
    count = len(stiffnesses)
    return MassChain(np.array(inertias), np.array(stiffnesses), np.zeros(count), 0.0)
