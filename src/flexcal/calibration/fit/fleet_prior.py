"""Prior of a robot's geometry from other robots of its model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from flexcal.estimation import Parameters

OF_THE_CELL = ("tool.", "point.", "station.", "sockets.", "board.", "camera.")
"""Beginnings of the names of parameters of tool, targets and instruments, of which another cell tells nothing."""


_FREE = 2.0
"""Spread of a parameter of which a prior tells nothing, relative to its deviation."""
_CERTAIN = 1e6
"""Degrees of freedom of a spread that is not estimated."""


@dataclass(frozen=True, eq=False)
class FleetPrior:
    """Normal distribution of geometric parameters over the robots of a model, as calibrated ones tell it.

    `mean` (p,) of the parameters `names` is known with the covariance `uncertainty` (p, p); robots differ from it by `spread` (p,), 1σ,
    which is known with `freedom` (p,) degrees of freedom. All are in natural units, as deviations from the URDF. `terms` are those fitted
    to the `robots`, the folders' names; `measurements` are the digests of theirs, `source` says where the prior was read. Of parameters
    in which a robot deviates alone, `released` has the deviations, in standard deviations of the prior: there it tells nothing.
    """

    names: tuple[str, ...]
    mean: np.ndarray
    uncertainty: np.ndarray
    spread: np.ndarray
    freedom: np.ndarray
    terms: tuple[str, ...]
    robots: tuple[str, ...]
    measurements: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    source: str = ""
    released: Mapping[str, float] = field(default_factory=dict)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (p, p) of a further robot's parameters about the mean."""
        return self.uncertainty + np.diag(self.spread**2)

    def among(self, names: Iterable[str]) -> FleetPrior:
        """Prior of those of its parameters that are among `names`, in their order."""
        own = {name: k for k, name in enumerate(self.names)}
        kept = [own[name] for name in names if name in own]
        return replace(
            self,
            names=tuple(self.names[k] for k in kept),
            mean=self.mean[kept],
            uncertainty=self.uncertainty[np.ix_(kept, kept)],
            spread=self.spread[kept],
            freedom=self.freedom[kept],
        )

    def without(self, deviations: Mapping[str, float]) -> FleetPrior:
        """Prior that tells nothing of parameters with these `deviations`, in its standard deviations: its spread is twice the deviation."""
        named = np.isin(self.names, list(deviations))
        size = np.array([abs(deviations.get(name, 0.0)) for name in self.names])
        return replace(
            self,
            spread=np.where(named, _FREE * size * np.sqrt(np.diag(self.covariance)), self.spread),
            freedom=np.where(named, _CERTAIN, self.freedom),
            released=dict(deviations),
        )

    def applied(self, parameters: Parameters) -> Parameters:
        """The `parameters`, starting from this prior where it has them."""
        means = dict(zip(self.names, self.mean.tolist(), strict=True))
        stds = dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))
        return Parameters(
            replace(
                item,
                value=max(means[item.name], item.lower),
                prior_mean=means[item.name],
                prior_std=stds[item.name],
            )
            if item.name in means
            else item
            for item in parameters
        )


def prior_covariance(parameters: Parameters, fleet: FleetPrior | None) -> np.ndarray:
    """Covariance (p, p) of the prior of geometric parameters, infinite on the diagonal where there is none."""
    covariance = np.diag(parameters.prior_std() ** 2)
    if fleet is not None:
        own = fleet.among(parameters.names)
        rows = [parameters.index(name) for name in own.names]
        covariance[np.ix_(rows, rows)] = own.covariance
    return covariance
