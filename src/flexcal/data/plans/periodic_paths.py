"""Periodic paths of joints, linear in their coefficients: finite Fourier series and cyclic B-splines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexcal.errors import FlexcalError

SPLINE_DEGREE = 5
"""Degree of the splines: accelerations have two continuous derivatives, so that drives can follow."""


@dataclass(frozen=True, eq=False)
class FourierPaths:
    """E paths of n joints, each a finite Fourier series of H harmonics in every joint (Swevers 1997).

    centre: (E, n) positions about which the joints move, rad.
    sine, cosine: (E, n, H) amplitudes of the velocity's sines and cosines at the multiples 1…H of the base frequency, rad/s.

    Raises `FlexcalError` where shapes do not fit together.
    """

    centre: NDArray[np.float64]
    sine: NDArray[np.float64]
    cosine: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("centre", "sine", "cosine"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        if self.centre.ndim != 2 or 0 in self.centre.shape:
            raise FlexcalError(
                "E-PLAN-012", "centre must be a list of trajectories, each a list with one angle per joint."
            )
        for name in ("sine", "cosine"):
            shape = getattr(self, name).shape
            if len(shape) != 3 or shape[:2] != self.centre.shape or not shape[2]:
                raise FlexcalError(
                    "E-PLAN-013",
                    f"{name} has shape {shape}; {self.centre.shape[0]} trajectories of {self.centre.shape[1]} joints need "
                    f"({self.centre.shape[0]}, {self.centre.shape[1]}, harmonics).",
                )
        if self.sine.shape != self.cosine.shape:
            raise FlexcalError("E-PLAN-014", "sine and cosine must have the same number of harmonics.")

    @classmethod
    def of_coefficients(cls, coefficients: np.ndarray) -> FourierPaths:
        """Paths of coefficients (E, 1 + 2 H, n): centres, sines, cosines."""
        each = coefficients.transpose(0, 2, 1)
        harmonics = each.shape[2] // 2
        return cls(each[:, :, 0], each[:, :, 1 : 1 + harmonics], each[:, :, 1 + harmonics :])

    @property
    def coefficients(self) -> np.ndarray:
        """Coefficients (E, 1 + 2 H, n), as `fourier_basis` takes them."""
        return np.concatenate([self.centre[:, :, None], self.sine, self.cosine], axis=2).transpose(0, 2, 1)

    def basis(self, time: np.ndarray, period: float) -> np.ndarray:
        """Basis (3, N, 1 + 2 H) from coefficients to position, velocity and acceleration at times (N,), s."""
        return fourier_basis(time, period, self.sine.shape[2])


@dataclass(frozen=True, eq=False)
class SplinePaths:
    """E paths of n joints, each a cyclic B-spline of degree 5 with K control points (E, n, K), rad, evenly spread over the period.

    Raises `FlexcalError` where they are fewer than 7.
    """

    control: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "control", np.asarray(self.control, dtype=np.float64))
        shape = self.control.shape
        if len(shape) != 3 or 0 in shape or shape[2] <= SPLINE_DEGREE + 1:
            raise FlexcalError(
                "E-PLAN-015",
                f"control has shape {shape}; give (trajectories, joints, control points), at least {SPLINE_DEGREE + 2} of these.",
            )

    @classmethod
    def of_coefficients(cls, coefficients: np.ndarray) -> SplinePaths:
        """Paths of coefficients (E, K, n)."""
        return cls(coefficients.transpose(0, 2, 1))

    @property
    def coefficients(self) -> np.ndarray:
        """Coefficients (E, K, n), as `spline_basis` takes them."""
        return self.control.transpose(0, 2, 1)

    def basis(self, time: np.ndarray, period: float) -> np.ndarray:
        """Basis (3, N, K) from control points to position, velocity and acceleration at times (N,), s."""
        return spline_basis(time, period, self.control.shape[2])


def fourier_basis(time: np.ndarray, period: float, harmonics: int) -> np.ndarray:
    """Fourier basis (3, N, 1 + 2 H): position, velocity and acceleration at times (N,), s, by centre, and sines and cosines of the
    velocity.
    """
    omega = 2 * np.pi / period * np.arange(1, harmonics + 1)
    s, c = np.sin(time[:, None] * omega), np.cos(time[:, None] * omega)
    centre = np.ones((len(time), 1))
    return np.array(
        [
            np.hstack([centre, -c / omega, s / omega]),
            np.hstack([0 * centre, s, c]),
            np.hstack([0 * centre, omega * c, -omega * s]),
        ]
    )


def spline_basis(time: np.ndarray, period: float, points: int) -> np.ndarray:
    """Spline basis (3, N, K) of K control points of a cyclic B-spline of degree 5 (de Boor 1978); the first acts from time 0 on."""
    from scipy.interpolate import BSpline

    piece = BSpline.basis_element(np.arange(SPLINE_DEGREE + 2.0), extrapolate=False)
    rate = points / period
    place = (time[:, None] * rate - np.arange(points)) % points
    return np.array([np.nan_to_num(piece.derivative(k)(place)) * rate**k for k in range(3)])
