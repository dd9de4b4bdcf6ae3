"""How large the errors at verification poses are, against what the parameters' covariance predicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.verification import Verification
from flexcal.errors import FlexcalError
from flexcal.estimation.gaussian_distance import distance_probability, principal_variances


@dataclass(frozen=True, eq=False)
class ErrorScale:
    """`factor` by which the predicted errors must be multiplied to be as large as the observed ones, with its 95 % interval.

    `freedom`: so many independent numbers the errors at all poses are worth, for they share one set of parameters. `probability` (N,): of
    an error no larger than the observed one, as predicted; uniform where the prediction is right. The instrument's noise is taken off
    where it is known, `noise_known`.
    """

    factor: float
    low: float
    high: float
    freedom: float
    probability: np.ndarray
    noise_known: bool

    @property
    def inside(self) -> float:
        """Share of the poses that lie within the bound predicted for 95 % of them."""
        return float((self.probability <= 0.95).mean())

    def document(self) -> dict[str, float | str]:
        """For JSON documents."""
        return {
            "factor": self.factor,
            "low": self.low,
            "high": self.high,
            "inside_95_percent": self.inside,
            "verdict": self.verdict,
        }

    @property
    def verdict(self) -> str:
        """Whether the prediction is "optimistic", "cautious", or "right" within chance; "unknown" where noise that is not known may be
        what makes errors larger.
        """
        if self.low > 1:
            return "optimistic" if self.noise_known else "unknown"
        return "cautious" if self.high < 1 else "right"


def error_scale(verification: Verification, roots: np.ndarray, noise: np.ndarray | None) -> ErrorScale:
    """Compare the errors of a verification with their prediction: `roots` (N, 3, p) m as `verify_jointly` gives them.

    `noise` (N, 3) m is 1σ of the instrument, None where unknown.

    With the errors' covariance f² A Aᵀ + S, A the roots of all poses together and S the noise's, their squared size has the mean
    f² tr A Aᵀ + tr S, which gives f, and is taken as χ² distributed with ν = (tr V)² / tr V² degrees of freedom (Satterthwaite, 1946),
    which gives its interval. Poses with an uncertain flank are left out: the covariance knows nothing of a wrong flank. Raises
    `FlexcalError` with fewer than two others.
    """
    clear = ~verification.ambiguous
    if clear.sum() < 2:
        raise FlexcalError(
            f"{int(clear.sum())} of the {len(clear)} verification poses have a certain backlash flank; measure two or more that have."
        )
    roots, errors = roots[clear], verification.errors[clear]
    sigma = np.zeros(errors.shape) if noise is None else noise[clear]
    stacked, spread = roots.reshape(-1, roots.shape[2]), sigma.ravel() ** 2
    gram = stacked.T @ stacked
    from_parameters, from_noise = float(np.trace(gram)), float(spread.sum())
    mixed = float(((stacked**2).sum(axis=1) * spread).sum())
    total = float((errors**2).sum())

    def mean_and_freedom(square: float) -> tuple[float, float]:
        mean = square * from_parameters + from_noise
        return mean, mean**2 / (
            square**2 * float((gram**2).sum()) + 2 * square * mixed + float((spread**2).sum())
        )

    factor = np.sqrt(max(total - from_noise, 0.0) / from_parameters)
    covariance = roots @ np.swapaxes(roots, 1, 2) + sigma[:, :, None] ** 2 * np.eye(3)
    distance = np.linalg.norm(errors, axis=1)
    return ErrorScale(
        factor=float(factor),
        low=_bound(total, mean_and_freedom, 0.975),
        high=_bound(total, mean_and_freedom, 0.025),
        freedom=mean_and_freedom(max(factor**2, 1e-12))[1],
        probability=distance_probability(distance, principal_variances(covariance)),
        noise_known=noise is not None,
    )


def _bound(total: float, mean_and_freedom: Callable[[float], tuple[float, float]], share: float) -> float:
    """The factor with which errors as large as the observed `total` m² would be exceeded with the probability 1 - `share`."""
    from scipy.optimize import brentq
    from scipy.special import gammaincinv

    def excess(factor: float) -> float:
        mean, freedom = mean_and_freedom(factor**2)
        return mean * 2 * float(gammaincinv(freedom / 2, share)) / freedom - total

    if excess(1e-6) >= 0:
        return 0.0
    most = 1.0
    while excess(most) < 0:
        most *= 2
    return brentq(excess, 1e-6, most)  # pyright: ignore[reportReturnType]
