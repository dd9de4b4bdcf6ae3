"""What the measured temperatures of a calibration can tell, apart from time and from the scatter of their sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.fit.thermal_terms import is_thermal, plausible_thermal_size
from flexcal.calibration.measurement import PredictedMeasurements
from flexcal.data.poses import PoseSet
from flexcal.estimation import f_tail

_SMOOTH = 0.5
"""Share of the scatter of the temperatures below which that from one measurement to the next is the sensor's."""
_FEWEST = 10
_CHANCE = 0.0027
_TOGETHER = 0.5
"""Correlation of temperature with time from which a widening by it is worth a sentence."""
_WIDER = 1.5


def sensor_scatter(poses: PoseSet) -> float | None:
    """Scatter, K (1σ), of a temperature's sensor, from second differences in the order of time; None where these are no noise.

    An arm's temperature changes smoothly, so that its second differences are small; √6 is what they are of independent errors. Where
    temperatures follow each other at random nothing tells the sensor's part.
    """
    assert poses.temperature is not None
    values = _in_time(poses)
    if len(values) < _FEWEST:
        return None
    jumps = np.abs(np.diff(values, 2))
    scatter = float(np.median(jumps)) / (0.6745 * np.sqrt(6))
    return scatter if scatter < _SMOOTH * float(values.std()) else None


def _in_time(poses: PoseSet) -> np.ndarray:
    """Temperatures in the order of time, one a pose."""
    assert poses.temperature is not None
    order = np.arange(len(poses)) if poses.time is None else np.argsort(poses.time, kind="stable")
    numbers = poses.pose[order]
    first = np.append(True, numbers[1:] != numbers[:-1])
    return poses.temperature[order][first]


@dataclass(frozen=True)
class TemperatureEvidence:
    """What temperatures tell of the thermal parameters of a fit.

    `lowest`, `highest` and `reference` temperature, °C; `spread`, their standard deviation, K; `correlation` with time, or with the
    measuring order where no `timed` column says it; `narrow`: standard deviations of the parameters if nothing but temperature changes
    with time, `wide` those with a change in time of the same kind; `probability` of the observed change in time beside temperature if
    there is none; `scatter` of the sensor, K, where it is told, and `attenuation`, the share by which that makes the coefficients too
    small.
    """

    lowest: float
    highest: float
    reference: float
    spread: float
    timed: bool
    correlation: float
    narrow: dict[str, float]
    wide: dict[str, float]
    probability: float
    scatter: float | None
    attenuation: float

    @classmethod
    def of(
        cls,
        poses: PoseSet,
        reference: float,
        narrow: dict[str, float],
        wide: dict[str, float],
        probability: float,
    ) -> TemperatureEvidence:
        """Evidence in the temperatures of fitted `poses`; the other arguments are the attributes of these names."""
        assert poses.temperature is not None
        return cls(
            lowest=float(poses.temperature.min()),
            highest=float(poses.temperature.max()),
            reference=reference,
            spread=float(poses.temperature.std()),
            timed=poses.time is not None,
            correlation=float(np.corrcoef(poses.temperature, _time(poses))[0, 1]),
            narrow=narrow,
            wide=wide,
            probability=probability,
            scatter=sensor_scatter(poses),
            attenuation=_attenuation(poses),
        )

    @property
    def confounded(self) -> bool:
        """Whether temperature and time cannot be told apart: a change in time would widen an interval clearly."""
        wider = max((self.wide[n] / self.narrow[n] for n in self.narrow if self.narrow[n] > 0), default=1.0)
        return abs(self.correlation) > _TOGETHER and wider > _WIDER

    @property
    def drifts(self) -> bool:
        """Whether the residuals change with time beside temperature, at three standard deviations."""
        return self.probability < _CHANCE


def time_columns(at: PredictedMeasurements, names: tuple[str, ...]) -> np.ndarray:
    """Readings (R, 3, k) by the thermal parameters `names` (k,), with time in place of temperature, scaled to the same variance."""
    poses = at.poses
    assert poses.temperature is not None
    time = _time(poses)
    share = (time - time.mean()) / (float(time.std()) or 1.0)
    apparent = at.model.thermal.reference[0] + float(poses.temperature.std()) * share
    return replace(at, poses=replace(poses, temperature=apparent)).jacobian(names)


def widened(
    poses: PoseSet,
    values: Mapping[str, float],
    covariance: np.ndarray,
    gain: np.ndarray,
    products: np.ndarray,
    freedom: int,
) -> tuple[np.ndarray, dict[str, float], float]:
    """Covariance (p, p) of estimates with what time and the temperature's sensor may have to do with them.

    `values` (p,) by name and `covariance` are of the estimate. Let D be the `time_columns` of its k thermal parameters. A change in time of
    plausible size s that is not in the model moves the estimates by G d, G (p, k) the `gain` of the fit; the data tell of d by S⁻¹, S being
    the scalar products of what the fit leaves of D, and the first k rows and columns of `products`, whose last are those with the
    residual. The covariance becomes Σ + G (S + diag(1/s²))⁻¹ Gᵀ, that of a fit with both. To this adds what the scatter σ of the sensor
    attenuates coefficients by, σ²/var(T) of their values (Fuller 1987, section 1.1). Also returns the standard deviations of the thermal
    parameters, and the p-value of Rao's score test for d = 0, the errors' variance being estimated with `freedom` degrees of freedom.
    """
    assert poses.temperature is not None
    own = [k for k, name in enumerate(values) if is_thermal(name)]
    thermal = [name for name in values if is_thermal(name)]
    sizes = np.array([plausible_thermal_size(name.rpartition(".")[2]) or np.inf for name in thermal])
    told = products[:-1, :-1]
    wide = covariance + gain @ np.linalg.solve(told + np.diag(1 / sizes**2), gain.T)
    bias = np.zeros(len(values))
    bias[own] = _attenuation(poses) * np.array([values[name] for name in thermal])
    wide = wide + np.outer(bias, bias)
    stds = dict(zip(thermal, np.sqrt(np.diag(wide)[own]).tolist(), strict=True))
    return wide, stds, _probability(products, sizes, freedom)


def _attenuation(poses: PoseSet) -> float:
    """Share by which the scatter of the temperature's sensor makes coefficients too small; 0 where it is not told."""
    assert poses.temperature is not None
    scatter = sensor_scatter(poses)
    return 0.0 if scatter is None else (scatter / float(poses.temperature.std())) ** 2


def _time(poses: PoseSet) -> np.ndarray:
    return np.arange(len(poses), dtype=float) if poses.time is None else poses.time


def _probability(products: np.ndarray, sizes: np.ndarray, freedom: int) -> float:
    """p-value of no change in time, over the directions that temperature leaves visible."""
    scale = np.append(sizes, 1.0)
    scaled = products * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled[:-1, :-1])
    seen = values > 1.0
    if not seen.any():
        return 1.0
    explained = float(((vectors[:, seen].T @ scaled[:-1, -1]) ** 2 / values[seen]).sum())
    count = int(seen.sum())
    left = max(freedom - count, 1)
    variance = max(1.0, (float(products[-1, -1]) - explained) / left)
    return f_tail(count, left, float(explained / variance / count))
