"""Typical values of quantities other than geometry over the robots of a model, and how much the robots differ."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from flexcal.estimation import individuals
from flexcal.report.results import chance_in_words

Scale = Literal["log", "linear"]
CLEAR = 4.0
"""Least value, in its standard deviations, whose logarithm has about a normal distribution."""
_REPRODUCIBLE = 0
_DRAWS = 4000
"""Robots of the model that are drawn for comparison."""
CONTRADICTED = 0.01
"""Probability below which pooled values do not fit a robot."""
_NAMED = 3.0
"""Deviation, in standard deviations of the next robot, from which a quantity is named."""


@dataclass(frozen=True, eq=False)
class PooledValues:
    """Normal distributions of p quantities over robots of a model, independent of each other.

    Everything but `mean`, in natural units, is in the coordinate of its `scale`: natural logarithms are relative. `mean` (p,) is known with
    the standard deviation `mean_std` (p,); robots differ from it by `spread` (p,), 1σ, known with `freedom` (p,) degrees of freedom. A
    quantity on a log scale has its median as `mean`. `condition` is what all `robots` were identified with and the next must be, such as
    the friction terms.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    scales: tuple[Scale, ...]
    mean: np.ndarray
    mean_std: np.ndarray
    spread: np.ndarray
    freedom: np.ndarray
    condition: str
    robots: tuple[str, ...]
    files: dict[str, str] = field(default_factory=dict)

    @property
    def std(self) -> np.ndarray:
        """Standard deviations (p,) of the next robot's quantities."""
        return np.hypot(self.mean_std, self.spread)

    def among(self, names: Iterable[str]) -> PooledValues:
        """Those of its quantities that are among `names`."""
        wanted = set(names)
        kept = [k for k, name in enumerate(self.names) if name in wanted]
        return replace(
            self,
            names=tuple(self.names[k] for k in kept),
            units=tuple(self.units[k] for k in kept),
            scales=tuple(self.scales[k] for k in kept),
            mean=self.mean[kept],
            mean_std=self.mean_std[kept],
            spread=self.spread[kept],
            freedom=self.freedom[kept],
        )

    @property
    def natural(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (p,) in natural units, of the log-normal distribution where the scale is logarithmic."""
        log = np.array(self.scales) == "log"
        variance = np.where(log, self.std, 0.0) ** 2
        mean = self.mean * np.exp(variance / 2)
        return mean, np.where(log, np.abs(mean) * np.sqrt(np.expm1(variance)), self.std)


@dataclass(frozen=True)
class PoolConflict:
    """Test whether a robot is one of those that values were pooled of.

    `probability` of deviations as large where it is one of them; `shifts` (name, deviation in standard deviations of the next robot) where
    it deviates, the farthest first.
    """

    probability: float
    shifts: tuple[tuple[str, float], ...]

    @property
    def contradicted(self) -> bool:
        """Whether the pooled values do not fit the robot."""
        return self.probability < CONTRADICTED

    @property
    def clause(self) -> str:
        """What contradicts, as the end of a sentence."""
        named = ", ".join(f"{name} ({shift:+.1f} σ)" for name, shift in self.shifts)
        return chance_in_words(self.probability, 2 / _DRAWS) + (f", most in {named}" if named else "")


def conflict(pooled: PooledValues, deviation: np.ndarray, covariance: np.ndarray) -> PoolConflict:
    """Test of a robot's `deviation` (p,) from the pooled means, known with `covariance` (p, p), both in the coordinates of the scales.

    The sum of squares, whitened by the covariance of the next robot and of its measurement, finds a robot that is off in many quantities,
    the largest of the deviations one that is off in one. Their distributions are those of robots drawn from the population, each quantity
    with a Student distribution where its spread is known with few degrees of freedom; the smaller p-value counts twice.
    """
    rng = np.random.default_rng(_REPRODUCIBLE)
    root = np.linalg.cholesky(np.diag(pooled.std**2) + covariance)
    size = np.sqrt(np.diag(root @ root.T))
    shape = (_DRAWS, len(pooled.names))
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    errors = rng.standard_normal(shape) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
    mean = pooled.mean_std * rng.standard_normal(shape)
    drawn = mean + individuals(pooled.spread, pooled.freedom, _DRAWS, rng) + errors

    def statistics(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.sum(np.linalg.solve(root, rows.T) ** 2, axis=0), np.abs(rows / size).max(axis=1)

    found, others = statistics(deviation[None]), statistics(drawn)
    tails = [(np.sum(other >= own) + 1) / (_DRAWS + 1) for own, other in zip(found, others, strict=True)]
    relative = deviation / size
    order = [k for k in np.argsort(-np.abs(relative)) if abs(relative[k]) > _NAMED][:3]
    return PoolConflict(
        min(1.0, 2 * float(min(tails))), tuple((pooled.names[k], float(relative[k])) for k in order)
    )
