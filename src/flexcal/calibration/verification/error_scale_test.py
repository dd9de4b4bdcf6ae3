"""Ratio of observed to predicted errors at verification poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.verification.unseen_poses import ErrorCovariance, PredictionErrors
from flexcal.errors import FlexcalError
from flexcal.estimation import distance_probability, principal_variances


@dataclass(frozen=True, eq=False)
class ErrorScale:
    """Ratio of observed to predicted size of the errors, with 95 % intervals.

    `ratio`, between `ratio_low` and `ratio_high`, is of the whole root mean square. `factor`, between `low` and `high`, is by how much
    the errors of parameters and model must be larger for that, independent noise being as it is. `freedom`: so many independent numbers the
    errors at all poses are worth, for they share one set of parameters. `probability` (N,): of an error no larger than the observed one, as
    predicted, the size of the scatter being known no better than the calibration found it; uniform where the prediction is right.
    `noise_known`: whether instrument and repeatability are among what is predicted.
    """

    factor: float
    low: float
    high: float
    ratio: float
    ratio_low: float
    ratio_high: float
    freedom: float
    probability: np.ndarray
    noise_known: bool

    @property
    def inside(self) -> float:
        """Share of the poses that lie within the bound predicted for 95 % of them."""
        return float((self.probability <= 0.95).mean())

    def document(self) -> dict[str, float | str | int]:
        """Block of a JSON document."""
        return {
            "poses": len(self.probability),
            "ratio": self.ratio,
            "ratio_low": self.ratio_low,
            "ratio_high": self.ratio_high,
            "factor": self.factor,
            "low": self.low,
            "high": self.high,
            "freedom": self.freedom,
            "inside_95_percent": self.inside,
            "verdict": self.verdict,
        }

    @property
    def verdict(self) -> str:
        """Verdict on the prediction: "optimistic", "cautious", or "right" within chance; "unknown" if unknown noise may explain larger
        errors.
        """
        if self.low > 1:
            return "optimistic" if self.noise_known else "unknown"
        return "cautious" if self.high < 1 else "right"


def error_scale(verification: PredictionErrors, covariance: ErrorCovariance) -> ErrorScale:
    """Compare the errors of a verification with their prediction by `prediction_errors_with_covariance`.

    With the errors' covariance f² A Aᵀ + S, A the roots of all poses together and S what is independent, their squared size has the mean
    f² tr A Aᵀ + tr S, which gives f, and is taken as χ² distributed with ν = (tr V)² / tr V² degrees of freedom (Satterthwaite, 1946),
    which gives the intervals. Poses with an uncertain flank are left out: the covariance knows nothing of a wrong flank. Raises
    `FlexcalError` with fewer than two others, and where nothing was predicted.
    """
    from scipy.special import fdtri

    clear = ~verification.ambiguous
    if clear.sum() < 2:
        raise FlexcalError(
            "E-CAL-017",
            f"{int(clear.sum())} of the {len(clear)} verification poses have a certain backlash flank; at least two are needed.",
        )
    roots, errors = covariance.roots[clear], verification.errors[clear]
    stacked = roots.reshape(-1, roots.shape[2])
    gram = stacked.T @ stacked
    visits, independent = covariance.by_visits(clear)
    from_parameters = float(np.trace(gram))
    from_noise = float(np.trace(independent, axis1=1, axis2=2).sum())
    if from_parameters + from_noise <= 0:
        raise FlexcalError(
            "E-CAL-018",
            "there are no estimated parameters from which an error could be predicted; calibrate the robot first.",
        )
    concentrated = covariance.concentrated
    weight = np.ones((1, 1, 1)) if concentrated is None else concentrated[clear, None, None]
    mixed = float(np.sum(weight * visits * np.matmul(independent, visits)))
    noise_squares = float(np.sum(weight * independent**2))
    total = float((errors**2).sum())

    def mean_and_freedom(square: float) -> tuple[float, float]:
        mean = square * from_parameters + from_noise
        spread = square**2 * float((gram**2).sum()) + 2 * square * mixed + noise_squares
        return mean, mean**2 / spread

    factor = np.sqrt(max(total - from_noise, 0.0) / max(from_parameters, 1e-30))
    predicted, freedom = mean_and_freedom(1.0)
    size = np.linalg.norm(errors, axis=1)
    whole = roots @ np.swapaxes(roots, 1, 2)
    if covariance.independent is not None:
        whole = whole + covariance.independent[clear]
    # both sizes have their chance: observed over predicted mean squares are F distributed
    low, high = (float(fdtri(freedom, min(covariance.freedom, 1e9), share)) for share in (0.975, 0.025))
    return ErrorScale(
        factor=float(factor),
        low=_bound(total, mean_and_freedom, 0.975),
        high=_bound(total, mean_and_freedom, 0.025),
        ratio=float(np.sqrt(total / predicted)),
        ratio_low=float(np.sqrt(total / predicted / low)),
        ratio_high=float(np.sqrt(total / predicted / high)),
        freedom=mean_and_freedom(max(factor**2, 1e-12))[1],
        probability=distance_probability(size, principal_variances(whole), covariance.freedom),
        noise_known=covariance.independent is not None,
    )


def prediction_document(
    verification: PredictionErrors, covariance: ErrorCovariance
) -> dict[str, float | str | int] | None:
    """Block of a JSON document from `error_scale`; None if errors and prediction cannot be compared."""
    try:
        return error_scale(verification, covariance).document()
    except FlexcalError:
        return None


def _bound(total: float, mean_and_freedom: Callable[[float], tuple[float, float]], share: float) -> float:
    """Scale factor for which errors as large as the observed `total` m² are exceeded with the probability 1 - `share`."""
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
        if most > 1e6:
            return float("inf")
    return brentq(excess, 1e-6, most)  # pyright: ignore[reportReturnType]
