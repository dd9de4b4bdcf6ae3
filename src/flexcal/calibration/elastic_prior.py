"""What is known of stiffness and inertia before the geometry is fitted: the posterior of stage 1, or CAD alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model import RobotModel
from flexcal.model.names import SPRINGS, unit_of

UNIDENTIFIED_STIFFNESS = 0.3
"""Relative 1σ of a stiffness that nothing but robot.yaml supports."""


@dataclass(frozen=True, eq=False)
class ElasticPrior:
    """Stiffness, inertia and payload parameters that deflection depends on, and their joint covariance (estimation coordinates)."""

    parameters: Parameters
    covariance: np.ndarray

    @classmethod
    def of(cls, model: RobotModel, poses: PoseSet, *, secant_scale: float = 0.0) -> ElasticPrior:
        """What the model's posterior holds of these parameters, and the declared priors of the others.

        `secant_scale` is the relative 1σ by which a drive's stiffness under gravity may differ from the tangent one of a frequency
        response: it widens the drive stiffnesses by one scale each.
        """
        names = _names(model, poses)
        items = [_declared(model, name) for name in names]
        covariance = np.diag([item.prior_std**2 for item in items])
        held = model.posterior
        known = [k for k, name in enumerate(names) if held.determines(name)]
        covariance[np.ix_(known, known)] = held.marginal([names[k] for k in known])
        for k in known:
            value = model.value(names[k])
            items[k] = replace(held.parameters[names[k]], value=value, prior_mean=value, prior_std=np.inf)
        for k, name in enumerate(names):
            if name.endswith("drive.stiffness"):
                covariance[k, k] += secant_scale**2
        return cls(Parameters(items), covariance)


NOTHING_ELASTIC = ElasticPrior(Parameters(), np.zeros((0, 0)))


def _names(model: RobotModel, poses: PoseSet) -> list[str]:
    if not model.elastic:
        return []
    names = [f"{e.name}.{SPRINGS[c]}.stiffness" for e in model.elastic for c in sorted(e.components)]
    carried = {i for i in range(model.n) if _carried(model, i)}
    for i in sorted(carried):
        keys = ["mass"] if model.prior.mass > 0 else []
        keys += ["com_x", "com_y", "com_z"] if model.prior.com > 0 else []
        if model.mass[i] > 0:
            names += [f"{model.joints[i].link}.{key}" for key in keys]
    held = model.nominal_payload
    if held is not None and held.mass_std > 0 and (poses.payload is None or poses.payload.any()):
        names.append("payload.mass")
    return names


def _carried(model: RobotModel, link: int) -> bool:
    """Whether a link hangs on a spring."""
    while link >= 0:
        if link in model.bearing_frames:
            return True
        link = model.joints[link].parent
    return False


def _declared(model: RobotModel, name: str) -> Parameter:
    value, key = model.value(name), name.rpartition(".")[2]
    if key == "stiffness":
        return Parameter(name, unit_of(name), value, prior_std=UNIDENTIFIED_STIFFNESS, scale="log")
    if name == "payload.mass":
        held = model.nominal_payload
        assert held is not None
        return Parameter(name, unit_of(name), value, prior_std=held.mass_std / held.mass, scale="log")
    if key == "mass":
        return Parameter(name, unit_of(name), value, prior_std=model.prior.mass, scale="log")
    return Parameter(name, unit_of(name), value, prior_std=model.prior.com)
