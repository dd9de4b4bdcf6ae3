"""Resonances and antiresonances of a modal fit, with confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from flexcal.elasticity.modal.fit import HEAVILY_DAMPED, ModalFit
from flexcal.elasticity.modal.record_least_squares import jacobian

_UNKNOWN = 0.3
"""Standard deviation of a logarithm from which a value is not determined."""
_LEVEL = 0.975
_GRID = 4000
_PROMINENT, _NEAR = 1.1, 0.35
"""Least ratio of a peak to the lowest magnitude on either side, within a neighbourhood in log f."""
_SPACING = 1e-3
"""Spacing (in log f) of three points for slope and curvature of a peak."""


@dataclass(frozen=True)
class LogValue:
    """Positive value estimated as its logarithm, with its standard deviation `log_std` and degrees of freedom."""

    estimate: float
    log_std: float
    degrees_of_freedom: float

    @property
    def known(self) -> bool:
        """Whether the data determine it."""
        return bool(np.isfinite(self.log_std)) and self.log_std < _UNKNOWN

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval."""
        half = float(student.ppf(_LEVEL, self.degrees_of_freedom)) * self.log_std
        return self.estimate * float(np.exp(-half)), self.estimate * float(np.exp(half))

    def quantity(self) -> dict[str, float | bool | None]:
        """{estimate, std, low, high, truth, identifiable}, as in results.json."""
        low, high = self.interval if self.known else (None, None)
        std = self.estimate * self.log_std if self.known else None
        return {
            "estimate": self.estimate,
            "std": std,
            "low": low,
            "high": high,
            "truth": None,
            "identifiable": self.known,
        }


@dataclass(frozen=True)
class Resonance:
    """Natural frequency (Hz) and damping ratio of a pole, or of a zero of one element."""

    frequency_hz: LogValue
    damping: LogValue


def resonances(fit: ModalFit) -> tuple[Resonance, ...]:
    """Modes in the band, heavily damped background terms excluded, by increasing frequency."""
    model, uncertainty = fit.model, fit.uncertainty
    std, count = np.sqrt(np.diag(uncertainty.covariance)), len(fit.model.natural)
    return tuple(
        Resonance(
            LogValue(float(model.frequencies_hz[m]), float(std[m]), uncertainty.degrees_of_freedom),
            LogValue(float(model.damping[m]), float(std[count + m]), uncertainty.degrees_of_freedom),
        )
        for m in range(count)
        if model.damping[m] < HEAVILY_DAMPED and _inside(fit, float(model.frequencies_hz[m]))
    )


def antiresonances(fit: ModalFit, output: int, input: int) -> tuple[Resonance, ...]:
    """Lightly damped zeros of an element in the band; the damping of a nonminimum-phase zero is negative and not determined."""
    uncertainty = fit.uncertainty
    zeros = fit.model.zeros(output, input)
    result = []
    scale = np.sqrt(np.diag(uncertainty.covariance))
    for zero in zeros:
        frequency, damping = abs(zero) / (2 * np.pi), -zero.real / abs(zero)
        if abs(damping) > HEAVILY_DAMPED or not _inside(fit, frequency):
            continue

        def moved(steps: np.ndarray, zero: complex = zero) -> np.ndarray:
            """log |s| and damping of the zero nearest to this one."""
            near_zeros = fit.moved(fit.parameters + steps * scale).zeros(output, input)
            nearest = near_zeros[np.argmin(np.abs(near_zeros - zero))] if near_zeros.size else zero
            return np.array([np.log(abs(nearest)), -nearest.real / abs(nearest)])

        derivative = jacobian(moved, np.zeros_like(scale), 1e-3)
        correlation = uncertainty.covariance / np.outer(scale, scale)
        std = np.sqrt(np.maximum(np.einsum("ip,pq,iq->i", derivative, correlation, derivative), 0.0))
        result.append(
            Resonance(
                LogValue(frequency, float(std[0]), uncertainty.degrees_of_freedom),
                LogValue(
                    float(damping),
                    float(std[1] / damping) if damping > 0 else np.inf,
                    uncertainty.degrees_of_freedom,
                ),
            )
        )
    return tuple(result)


@dataclass(frozen=True)
class Peak:
    """Maximum of the magnitude of one element, as read off a plot: frequency (Hz) and magnitude."""

    frequency_hz: LogValue
    magnitude: float


def peaks(fit: ModalFit, output: int, input: int) -> tuple[Peak, ...]:
    """Maxima of |G| of the modal model in the band; with heavy damping they differ from the natural frequencies."""
    band, uncertainty = fit.data.spectra.frequencies_hz, fit.uncertainty
    grid = np.geomspace(band[0], band[-1], _GRID)
    scale = np.sqrt(np.diag(uncertainty.covariance))
    correlation = uncertainty.covariance / np.outer(scale, scale)
    magnitude = np.abs(fit.model.response(grid)[:, output, input])
    result = []
    for at in np.flatnonzero((magnitude[1:-1] > magnitude[:-2]) & (magnitude[1:-1] >= magnitude[2:])) + 1:
        beside = np.abs(np.log(grid / grid[at])) < _NEAR
        lowest = [magnitude[beside & side].min() for side in (grid <= grid[at], grid >= grid[at])]
        if magnitude[at] < _PROMINENT * max(lowest):
            continue
        near = grid[at] * np.exp(_SPACING * np.arange(-1, 2))

        def slope(steps: np.ndarray, near: np.ndarray = near) -> np.ndarray:
            """Slope and curvature of log |G| against log f (2,)."""
            moved = fit.moved(fit.parameters + steps * scale).response(near)[:, output, input]
            low, middle, high = np.log(np.abs(moved))
            return np.array([(high - low) / (2 * _SPACING), (high - 2 * middle + low) / _SPACING**2])

        curvature = float(slope(np.zeros_like(scale))[1])
        if not curvature < 0:
            continue
        derivative = jacobian(slope, np.zeros_like(scale), 1e-3)[0]
        std = float(np.sqrt(max(derivative @ correlation @ derivative, 0.0))) / -curvature
        result.append(
            Peak(LogValue(float(grid[at]), std, uncertainty.degrees_of_freedom), float(magnitude[at]))
        )
    return tuple(result)


def _inside(fit: ModalFit, frequency: float) -> bool:
    band = fit.data.spectra.frequencies_hz
    return band[0] <= frequency <= band[-1]
