"""Joint prior of a robot's base parameters, springs and geometry for the identification of a payload."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.estimation import Estimate, Parameters
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import PARALLEL, declared_parameter

FRICTION = ("viscous", "coulomb", "torque_offset")
_STEP = 1e-4
"""Step of the central differences, in estimation coordinates."""
_NOTHING = 1e-12
"""Scaled variance, relative to the largest, below which a direction of the covariance counts as known exactly."""


@dataclass(frozen=True, eq=False)
class RobotPrior:
    """Base parameters (r,) = `base` + `base_root` z + `free` y, and deviations of `sources` (s,) = `source_root` z.

    z (k,) are independent with unit variance, y (d,) is not known at all; `base_root` (r, k), `free` (r, d), `source_root` (s, k).
    """

    base: np.ndarray
    base_root: np.ndarray
    free: np.ndarray
    sources: tuple[str, ...]
    source_root: np.ndarray

    @classmethod
    def of(
        cls,
        observation: Observation,
        base: BaseParameters,
        estimate: Estimate | None,
        sources: tuple[str, ...] = (),
    ) -> RobotPrior:
        """Prior from the posterior of the observed model, in which `estimate` is the block `dynamics`; without it the base parameters
        are free.

        A base parameter that the recordings of `estimate` hid is free, with those that took its place; so is friction that was found beside
        terms which are not the classic ones of `observation`, and a drive's parameter that was not found at all. The `sources` of error
        are as the posterior knows them, else as uncertain as declared.
        """
        model = observation.model
        links = {joint.link for joint in model.joints}
        kept = base.identifiability.kept_names
        owned = [
            name
            for name in model.posterior.parameters.names
            if name.rpartition(".")[0] in links or name in observation.names
        ]
        dynamics = (
            [name for name in owned if model.posterior.determines(name)] if estimate is not None else []
        )
        others = [name for name in sources if name not in dynamics]
        items = (
            *model.posterior.parameters.subset(dynamics),
            *(declared_parameter(model, name) for name in others),
        )
        covariance = model.posterior.prior(Parameters(items))[1]
        root = _root(covariance)
        base_root = _jacobian(observation, base, owned, dynamics) @ root[: len(dynamics)]
        free = np.eye(len(kept)) if estimate is None else _free(estimate, kept)
        values = base.identifiability.regrouping @ observation.values()
        return cls(
            values, base_root, free, sources, root[[(dynamics + others).index(name) for name in sources]]
        )


def _root(covariance: np.ndarray) -> np.ndarray:
    """Square root L (p, k) with L Lᵀ the covariance."""
    std = np.sqrt(np.diag(covariance))
    scale = np.where(std > 0, std, 1.0)
    sizes, turns = np.linalg.eigh(covariance / np.outer(scale, scale))
    seen = sizes > _NOTHING * sizes.max(initial=0.0)
    return scale[:, None] * turns[:, seen] * np.sqrt(sizes[seen])


def _jacobian(
    observation: Observation, base: BaseParameters, owned: list[str], names: list[str]
) -> np.ndarray:
    """Derivative (r, k) of the base parameters by the named ones of those `owned`, in estimation coordinates; the others constant."""
    model = observation.model
    own = model.posterior.parameters.subset(owned)
    x = own.coordinates()
    result = np.zeros((base.rank, len(names)))

    def at(moved: np.ndarray) -> np.ndarray:
        robot = model.with_values(dict(zip(owned, own.natural(moved), strict=True)))
        known = robot.values
        values = np.nan_to_num([known.get(name, 0.0) for name in observation.names])
        return base.identifiability.regrouping @ values

    for k, name in enumerate(names):
        size = _STEP * max(1.0, abs(x[own.index(name)]))
        step = size * (np.arange(len(x)) == own.index(name))
        result[:, k] = (at(x + step) - at(x - step)) / (2 * size)
    return result


def _free(estimate: Estimate, kept: tuple[str, ...]) -> np.ndarray:
    """Directions (r, d) of the base parameters that an estimate does not determine."""
    columns = []
    classic = all(_classic(name) for name in estimate.parameters.names)
    for entry in estimate.dropped:
        if entry.name in kept:
            column = np.zeros(len(kept))
            column[kept.index(entry.name)] = 1.0
            for heir, share in entry.absorbed_by:
                if heir in kept:
                    column[kept.index(heir)] -= share
            columns.append(column)
    for number, name in enumerate(kept):
        key = name.rpartition(".")[2].partition("_at_")[0]
        of_drive = key not in LINK_PARAMETERS
        lacking = of_drive and name not in estimate.parameters
        if lacking or (of_drive and not classic and key in FRICTION):
            columns.append(np.eye(len(kept))[number])
    return np.array(columns).reshape(-1, len(kept)).T


def _classic(name: str) -> bool:
    """Whether a parameter belongs to a link or to the classic terms of a drive."""
    key = name.rpartition(".")[2].partition("_at_")[0]
    return key in LINK_PARAMETERS or key.startswith("com_") or key in ("rotor_inertia", *FRICTION, *PARALLEL)
