"""Covariance of a calibration's estimate over parameters of a robot that other calibrations of it may have too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.calibration.comparison.common_poses import columns, rigid_motions
from flexcal.calibration.comparison.joint_covariance import SplitCovariance, split_covariance
from flexcal.calibration.fit import plausible_size
from flexcal.calibration.measurement import random_poses, seen_from_base
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Parameters
from flexcal.model.robot import GEOMETRY, RobotModel, declared_parameter


def split_of(
    model: RobotModel, estimate: Estimate, names: list[str], others: Sequence[Estimate], same_springs: bool
) -> SplitCovariance:
    """Covariance of an estimate, with terms that only `others` have as held at nothing."""
    waves = {name: size for e in (*others, estimate) for name, size in waves_of(e).items()}
    prior = {p.name: p.prior_std for p in estimate.parameters if np.isfinite(p.prior_std)} | waves_of(
        estimate
    )
    elastic = [n for n in names if n in estimate.parameters and not is_geometric(model, n)]
    joint = _prior_of_springs(model, elastic) if same_springs else ((), np.zeros((0, 0)))
    split = split_covariance(estimate, names, {n: s for n, s in prior.items() if n not in joint[0]}, joint)
    absent = [n for n in names if n not in estimate.parameters and is_geometric(model, n)]
    if not absent:
        return split
    kept = [n for n in names if n in estimate.parameters and is_geometric(model, n) and estimate.std(n)]
    ranges = np.array([estimate.ranges.get(n, (-np.pi, np.pi)) for n in model.motor_names]).T
    there = random_poses(model, ranges, targets_of(model, estimate), max(60, len(names)))
    at = seen_from_base(model, there, jacobians=True)
    free = np.hstack([columns(at, kept), rigid_motions(at.position)])
    taken = -np.linalg.lstsq(free, columns(at, absent), rcond=1e-9)[0][: len(kept)]
    sizes = np.array([waves.get(n) or plausible_size(model, n) for n in absent])
    added = np.zeros((len(names), len(absent)))
    added[[names.index(n) for n in kept]] = taken * sizes
    added[[names.index(n) for n in absent], range(len(absent))] = sizes
    return SplitCovariance(
        split.names, split.noise, np.hstack([split.known, added]), (*split.sources, *absent)
    )


def waves_of(estimate: Estimate) -> dict[str, float]:
    """Standard deviations of the waves that are random effects, by name."""
    terms = estimate.provenance.get("option.terms", "").split()
    size = estimate.values.get("scatter.transmission", 0.0)
    if "transmission" not in terms or not size > 0:
        return {}
    found = {}
    for name in estimate.parameters.names:
        key = name.rpartition(".")[2]
        if key.startswith("transmission_") and key.rpartition("_")[0] not in terms:
            found[name] = size / float(key.split("_")[1])
    return found


def _prior_of_springs(model: RobotModel, names: list[str]) -> tuple[list[str], np.ndarray]:
    """Joint covariance of stiffness and inertia before the calibrations, natural units, of those that have one."""
    declared = Parameters(declared_parameter(model, name) for name in names)
    covariance = model.posterior.prior(declared)[1]
    slopes = declared.natural_slope(declared.coordinates())
    covariance = slopes[:, None] * covariance * slopes
    known = [k for k in range(len(names)) if 0 < covariance[k, k] < np.inf]
    return [names[k] for k in known], covariance[np.ix_(known, known)]


def estimated(model: RobotModel, estimate: Estimate) -> RobotModel:
    """Robot with the values of an estimate, but for the places of stations."""
    known = model.values
    return model.with_values(
        {
            name: value
            for name, value in estimate.values.items()
            if name in known and not name.startswith("station.")
        }
    )


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Matrix (p, p) whose product with its transpose is a covariance (p, p)."""
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    return size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def size_of(model: RobotModel, name: str) -> float:
    """Size of a change that matters, natural units."""
    return plausible_size(model, name) if is_geometric(model, name) else 1e-3 * abs(model.value(name)) or 1e-6


def is_geometric(model: RobotModel, name: str) -> bool:
    """Whether a parameter is one of the geometry."""
    try:
        plausible_size(model, name)
    except (KeyError, FlexcalError):
        return False
    return True


def targets_of(model: RobotModel, estimate: Estimate) -> list[str]:
    """Points on the tool that a calibration measured."""
    told = estimate.provenance.get("option.targets", "").split(", ")
    return [name for name in told if name in model.points] or [next(iter(model.points))]


def common_targets(model: RobotModel, estimates: Sequence[Estimate]) -> list[str]:
    """Points on the tool that all calibrations measured."""
    first, *others = (targets_of(model, estimate) for estimate in estimates)
    return [name for name in first if all(name in other for other in others)]


def place_of(model: RobotModel, target: str) -> list[str]:
    """Parameters of the place of a point on the tool."""
    if target == model.tool_point:
        return [f"tool.{key}" for key in GEOMETRY if key.startswith("length")]
    return [f"point.{target}.{axis}" for axis in "xyz"]
