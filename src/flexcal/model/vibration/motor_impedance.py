"""Effect of impedances between motor and ground on a frequency response."""

from __future__ import annotations

import numpy as np

KNOT_OCTAVES = 0.5
"""Octaves between the knots of a frequency-dependent change."""


def friction_response_change(
    response: np.ndarray, frequencies_hz: np.ndarray, size: np.ndarray, octave: float
) -> np.ndarray:
    """∂G (L, m, E, k) by friction impedances `size` (E,) N m s/rad at each knot, real and imaginary: -G e eᵀ G / jω.

    The first E of the m outputs are the motors' accelerations.
    """
    s = 2j * np.pi * frequencies_hz[:, None, None, None]
    change = -np.einsum("lia,laj->lija", response, response[:, : response.shape[2]]) * size / s
    return over_frequency(change, frequencies_hz, octave)


def over_frequency(change: np.ndarray, frequencies_hz: np.ndarray, octave: float) -> np.ndarray:
    """Changes (L, E, E, k) with a complex factor interpolated over frequency, by its real and imaginary part at knots, (L, E, E, 2 k
    knots).
    """
    position = np.log2(frequencies_hz / frequencies_hz[0]) / octave
    knots = np.arange(int(np.ceil(position[-1])) + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(position[:, None] - knots))
    spread = change[..., None] * hats[:, None, None, None, :]
    spread = spread.reshape(*change.shape[:3], -1)
    return np.concatenate([spread, 1j * spread], axis=-1)
