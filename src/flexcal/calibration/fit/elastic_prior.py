"""Prior of stiffness and inertia for the geometric calibration: posterior of stage 1, or CAD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.kinds import KINDS
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model.robot import (
    SPRINGS,
    RobotModel,
    declared_parameter,
    uncertain_inertials,
    uncertain_payload,
    unit_of,
)

_FARTHEST = 10.0
"""Standard deviations, as declared, by which stiffness and inertia are at most off."""


@dataclass(frozen=True, eq=False)
class ElasticPrior:
    """Prior of the stiffness, inertia and payload parameters that deflection depends on, with joint covariance (estimation coordinates)."""

    parameters: Parameters
    covariance: np.ndarray

    @classmethod
    def of(cls, model: RobotModel, poses: PoseSet, *, secant_scale: float = 0.0) -> ElasticPrior:
        """Prior of the parameters: the model's posterior for those in it, else the declared priors.

        `secant_scale` is the relative 1σ by which a drive's stiffness under gravity may differ from the tangent one of a frequency
        response: it widens the drive stiffnesses by one scale each.
        """
        names = _names(model, poses)
        items = [_bounded(declared_parameter(model, name)) for name in names]
        posterior = model.posterior
        covariance = posterior.prior(Parameters(items))[1]
        items = [replace(i, prior_std=np.inf) if posterior.determines(i.name) else i for i in items]
        for k, name in enumerate(names):
            if name.endswith("drive.stiffness"):
                covariance[k, k] += secant_scale**2
        return cls(Parameters(items), covariance)

    def started(self, values: Mapping[str, float]) -> ElasticPrior:
        """The same prior for a fit that starts at those of the `values` that it has."""
        items = (
            replace(
                item,
                value=values.get(item.name, item.value),
                prior_mean=item.value if item.prior_mean is None else item.prior_mean,
            )
            for item in self.parameters
        )
        return replace(self, parameters=Parameters(items))

    def beside(self, waves: Mapping[str, float], std: float) -> ElasticPrior:
        """Prior with the `waves` of transmission errors, each with its size relative to order 1, whose 1σ is `std` rad; none for 0."""
        if not waves or std == 0:
            return self
        items = Parameters(Parameter(name, unit_of(name), 0.0) for name in waves)
        return self.joined(items, np.diag((std * np.array(list(waves.values()))) ** 2))

    def joined(self, items: Parameters, covariance: np.ndarray) -> ElasticPrior:
        """Prior with further parameters, independent of these, and their covariance (p, p)."""
        size = len(self.parameters)
        whole = np.zeros((size + len(items), size + len(items)))
        whole[:size, :size], whole[size:, size:] = self.covariance, covariance
        return ElasticPrior(self.parameters + items, whole)


def _bounded(item: Parameter) -> Parameter:
    """The same parameter within some declared deviations: wrong readings are to show as such, not as an arm that collapses."""
    at, far = item.coordinate(item.value), _FARTHEST * item.prior_std
    lower, upper = item.natural(at - far), item.natural(at + far)
    return replace(item, lower=max(item.lower, lower), upper=min(item.upper, upper))


def with_instruments(prior: ElasticPrior, model: RobotModel, poses: PoseSet) -> ElasticPrior:
    """Prior with the parameters of the instruments about which something is known beforehand."""
    for kind in KINDS:
        prior = prior.joined(*kind.uncertain(model, poses))
    return prior


NOTHING_ELASTIC = ElasticPrior(Parameters(), np.zeros((0, 0)))


def _names(model: RobotModel, poses: PoseSet) -> list[str]:
    if not model.elastic:
        return []
    names = [f"{e.name}.{SPRINGS[c]}.stiffness" for e in model.elastic for c in sorted(e.components)]
    names += [name for e in model.elastic if model.posterior.determines(name := f"{e.name}.drive.hardening")]
    names += uncertain_inertials(model, [i for i in range(len(model.joints)) if _carried(model, i)])
    if poses.payload is None or poses.payload.any():
        names += uncertain_payload(model)
    return names


def _carried(model: RobotModel, link: int) -> bool:
    """Whether a link is carried by a spring."""
    return any(joint in model.springs.bearing_frames for joint in model.moving(link))
