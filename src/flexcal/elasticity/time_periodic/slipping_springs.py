"""Equivalent stiffness and damping of a gear's hysteresis in a frequency experiment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.vibration import KNOT_OCTAVES

LIMITS = np.geomspace(1e-5, 2e-3, 20)
"""Twists (k,) rad at which the spring slips, a constant ratio apart, between whose gains those of others are interpolated."""

CYCLES = 34
"""Number of cycles of the reference motion over which gains are averaged."""

SAMPLES = 8
"""Number of samples in a period of the highest line."""

PHASES = 16
"""Number of phases of the reference motion with gains of their own."""


@dataclass(frozen=True, eq=False)
class SlippingSprings:
    """Gains of a spring that slips at a twist (a Jenkins element) for the small motion of every drive, at `LIMITS`.

    Of its force over its stiffness, the least squares by the multisine's twist and its rate have the coefficients `along` (k, 2, phases,
    E), the second in s, along the reference motion (quasi-linearisation after Bussgang 1952 for a force with memory); `lines` (k, L, E)
    is its complex gain at the lines, `frequencies_hz` (L,), smooth over frequency, less what the mean of these is there. The element
    slips with the whole motion, reference motion and multisine together.
    """

    frequencies_hz: np.ndarray
    along: np.ndarray
    lines: np.ndarray

    @classmethod
    def of(
        cls, slow: np.ndarray, size: np.ndarray, frequencies_hz: np.ndarray, reference_hz: float
    ) -> SlippingSprings:
        """Gains for twists `slow` (phases, E) rad over one cycle of the reference motion and multisines of random phases whose lines have
        the amplitudes `size` (L, E) rad.
        """
        rng = np.random.default_rng(0)
        step = 1 / (SAMPLES * frequencies_hz[-1])
        time = step * np.arange(round((CYCLES + 1) / reference_hz / step))
        turning = np.exp(2j * np.pi * np.outer(time, frequencies_hz))
        waves = size * np.exp(1j * rng.uniform(0, 2 * np.pi, size.shape))
        small = np.real(turning @ waves)
        rate = np.real(turning @ (2j * np.pi * frequencies_hz[:, None] * waves))
        turn = np.arange(len(slow) + 1) / len(slow)
        at = (reference_hz * time) % 1.0
        moved = small + np.stack([np.interp(at, turn, x) for x in np.vstack([slow, slow[:1]]).T], axis=1)
        slip = np.zeros((len(time), len(LIMITS), size.shape[1]))
        lower, upper = -LIMITS[:, None], LIMITS[:, None]
        for k, change in enumerate(np.diff(moved, axis=0), start=1):
            extension = np.add(slip[k - 1], change, out=slip[k])
            np.minimum(np.maximum(extension, lower, out=extension), upper, out=extension)
        kept = slice(len(time) // (CYCLES + 1), None)  # the element forgets where it began
        small, rate, slip, turning = small[kept], rate[kept], slip[kept], turning[kept]
        cell = (len(slow) * at[kept]).astype(int)
        for column in slip.reshape(len(slip), -1).T:  # less what the slow motion makes of it in every cycle
            column -= (np.bincount(cell, column) / np.maximum(np.bincount(cell), 1))[cell]
        phase = np.eye(PHASES)[np.rint(PHASES * at[kept]).astype(int) % PHASES]
        along = np.stack(
            [
                np.einsum("tp,tke,te->kpe", phase, slip, x, optimize=True) / (phase.T @ x**2)
                for x in (small, rate)
            ],
            axis=1,
        )
        # at the lines: least squares of smooth gains
        seen = 2 / len(small) * np.einsum("tl,tke->kle", turning.conj(), slip, optimize=True)
        position = np.log2(frequencies_hz / frequencies_hz[0]) / KNOT_OCTAVES
        knots = np.arange(int(np.ceil(position[-1])) + 1)
        hats = np.maximum(0.0, 1.0 - np.abs(position[:, None] - knots))
        lines = np.empty((len(LIMITS), *size.shape), dtype=complex)
        for e in range(size.shape[1]):
            smooth = np.linalg.lstsq(hats * waves[:, e, None], seen[:, :, e].T)[0]
            lines[:, :, e] = (hats @ smooth).T
        mean = along.mean(axis=2)
        lines -= mean[:, 0, None] + 2j * np.pi * frequencies_hz[:, None] * mean[:, 1, None]
        return cls(frequencies_hz, along, lines)

    def mean(self, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping gains (2, E) for slipping twists `limits` (E,) rad, and their derivatives (2, E) by the logarithm."""
        return _interpolated(self.along.mean(axis=2), limits)

    def course(self, limits: np.ndarray, phases: int) -> np.ndarray:
        """Both gains at `phases` of the reference motion less their mean, (2, phases, E)."""
        along = _interpolated(self.along, limits)[0]
        along -= along.mean(axis=1, keepdims=True)
        at, turn = np.arange(phases) / phases, np.arange(PHASES) / PHASES
        return np.stack([[np.interp(at, turn, x, period=1.0) for x in y.T] for y in along]).swapaxes(1, 2)

    def at(self, limits: np.ndarray, frequencies_hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Complex gains (L, E) at `frequencies_hz` (L,) less what the mean is, and their derivatives (L, E) by the logarithm."""
        gains, slopes = (
            np.stack([np.interp(frequencies_hz, self.frequencies_hz, x) for x in lines.T], axis=1)
            for lines in _interpolated(self.lines, limits)
        )
        return gains, slopes


def _interpolated(gains: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gains (..., E) and their derivatives by the logarithm of the `limits` (E,), of gains (k, ..., E) at `LIMITS`; constant beyond these.

    Cubic Hermite interpolation with the slopes of parabolas: where a derivative jumps, a fit may end at a point that is no minimum.
    """
    step = np.log(LIMITS[1] / LIMITS[0])
    at = np.clip(np.log(limits / LIMITS[0]) / step, 0, len(LIMITS) - 1)
    k = np.minimum(at.astype(int), len(LIMITS) - 2)
    bend = np.zeros_like(gains)
    bend[1:-1] = (gains[2:] - gains[:-2]) / 2
    axis = np.arange(len(limits))
    low, high, first, last = (
        np.moveaxis(values[i, ..., axis], 0, -1)
        for values, i in ((gains, k), (gains, k + 1), (bend, k), (bend, k + 1))
    )
    square, cube = 3 * (high - low) - 2 * first - last, first + last - 2 * (high - low)
    part = at - k
    value = low + part * (first + part * (square + part * cube))
    return value, (first + part * (2 * square + 3 * part * cube)) / step
