"""Pooling of the stiffness and the friction that were identified of several robots of a model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Measured, population
from flexcal.files.formats import block_sha256
from flexcal.jobs.fleet_prior.geometry_information import independent_combinations
from flexcal.jobs.fleet_prior.member import FEWEST, Member
from flexcal.jobs.fleet_prior.pooled_values import CLEAR, PooledValues, Scale
from flexcal.model.robot import DRIVE_GAIN, FRICTION_PARAMETERS, MASS_AND_COM, SPRING_LOG_STD

_USEFUL = 0.7
"""Standard deviation of the logarithm of a quantity of the next robot from which the others tell too little of it: a factor of two."""
_FRICTION_SIZE = 1.0
"""Plausible size of the logarithm of friction about the median of the robots."""
FRICTION = ("viscous", "coulomb", *FRICTION_PARAMETERS)
SPRING = ".stiffness"


def pool_springs(members: Sequence[Member]) -> PooledValues:
    """Stiffnesses of drives and bearings over robots whose responses were identified, on a log scale: springs are positive, and those
    of one type differ by per cent.

    Frequency responses tell a stiffness over the inertia that it carries, and that is from the same CAD for all robots: masses, centres of
    mass, rotor inertias and drive gains are pooled with them, so that their common error does not average out over robots.

    Raises `FlexcalError` for fewer than three robots, and for robots that are no one population.
    """
    _require_alike(members, "stiffness", "bearings", "bearing axes")
    names = _names(members, _is_of_springs)
    reference, sizes = [], []
    for name in names:
        items = [m.estimate.parameters[name] for m in members if name in m.estimate.parameters]
        first = items[0]
        middle = float(np.median([item.coordinate(item.value) for item in items]))
        nominal = first.coordinate(first.value if first.prior_mean is None else first.prior_mean)
        spring = name.endswith(SPRING)
        reference.append(middle if spring else nominal)
        sizes.append(SPRING_LOG_STD if spring or not np.isfinite(first.prior_std) else first.prior_std)
    scales: list[Scale] = ["log"] * len(names)
    quantities = _Quantities(names, scales, np.array(reference), np.array(sizes))
    measured = [_spring_information(member.estimate, quantities) for member in members]
    springs = [name for name in names if name.endswith(SPRING)]
    return quantities.pooled(members, measured, "bearings").among(springs)


def pool_friction(members: Sequence[Member]) -> PooledValues:
    """Viscous and Coulomb friction, and that of further terms, over robots whose torques were identified with the same terms.

    Those of a kind that are clearly positive on all robots are pooled on a log scale, since friction differs by shares of itself; others
    on a linear one, in units of their own size.

    Raises `FlexcalError` for fewer than three robots, and for robots that are no one population.
    """
    _require_alike(members, "dynamics", "friction", "friction terms")
    names = _names(members, _is_friction)
    kinds = {name.rpartition(".")[2] for name in names}
    log = {kind for kind in kinds if all(_is_positive(m.estimate, names, kind) for m in members)}
    scales: list[Scale] = ["log" if name.rpartition(".")[2] in log else "linear" for name in names]
    values = [[m.estimate.values[n] for m in members if _told(m.estimate, n)] for n in names]
    pairs = list(zip(scales, values, strict=True))
    reference = np.array([np.log(np.median(v)) if scale == "log" else 0.0 for scale, v in pairs])
    sizes = np.array(
        [_FRICTION_SIZE if scale == "log" else max(np.max(np.abs(v)), 1e-12) for scale, v in pairs]
    )
    quantities = _Quantities(names, scales, reference, sizes)
    measured = [_friction_information(member.estimate, quantities) for member in members]
    return quantities.pooled(members, measured, "friction")


@dataclass(frozen=True, eq=False)
class _Quantities:
    """p quantities of robots on their scales, as deviations from a `reference` (p,) with the plausible `sizes` (p,)."""

    names: Sequence[str]
    scales: Sequence[Scale]
    reference: np.ndarray
    sizes: np.ndarray

    def pooled(self, members: Sequence[Member], measured: Sequence[Measured], option: str) -> PooledValues:
        """Those that are useful over the `members`, of which these deviations were `measured`; the members have the `option` in common."""
        names, scales, sizes = self.names, self.scales, self.sizes
        kinds = [f"{scale}, {name.partition('.')[2]}" for name, scale in zip(names, scales, strict=True)]
        found = population(measured, sizes, kinds)
        known = np.sqrt(np.diag(found.uncertainty))
        log = np.array(scales) == "log"
        unit = np.where(log, sizes, 1.0)
        kept = np.flatnonzero(np.hypot(known, found.spread) < _USEFUL * sizes / unit).tolist()
        units = {item.name: item.unit for m in members for item in m.estimate.parameters}
        mean = self.reference + found.mean
        return PooledValues(
            tuple(names[k] for k in kept),
            tuple(units[names[k]] for k in kept),
            tuple(scales[k] for k in kept),
            np.array([np.exp(mean[k]) if log[k] else mean[k] for k in kept]),
            known[kept],
            found.spread[kept],
            found.freedom[kept],
            _condition(members[0], option),
            tuple(member.name for member in members),
            {m.name: block_sha256(m.source, m.block) for m in members if m.source is not None},
        )


def _names(members: Sequence[Member], wanted: Callable[[str], bool]) -> list[str]:
    """Parameters of the kind that three robots or more tell."""
    every = dict.fromkeys(item.name for m in members for item in m.estimate.parameters if wanted(item.name))
    return [name for name in every if sum(_told(m.estimate, name) for m in members) >= FEWEST]


def _is_of_springs(name: str) -> bool:
    key = name.rpartition(".")[2]
    return name.endswith(SPRING) or (
        key in ("rotor_inertia", DRIVE_GAIN, *MASS_AND_COM) and not name.startswith("payload.")
    )


def _is_friction(name: str) -> bool:
    key = name.rpartition(".")[2]
    return key in FRICTION or key.startswith(("viscous_at_", "coulomb_at_"))


def _told(estimate: Estimate, name: str) -> bool:
    """Whether a parameter was estimated, and is itself: it absorbed none that the measurements hide."""
    if name not in estimate.parameters:
        return False
    number = estimate.parameters.index(name)
    return bool(estimate.covariance[number, number] > 0)


def _is_positive(estimate: Estimate, names: Sequence[str], kind: str) -> bool:
    own = [name for name in names if name.rpartition(".")[2] == kind and _told(estimate, name)]
    return all(
        estimate.values[n] > CLEAR * np.sqrt(estimate.covariance[k, k])
        for n in own
        for k in [estimate.parameters.index(n)]
    )


def _spring_information(estimate: Estimate, quantities: _Quantities) -> Measured:
    """What responses tell of springs and inertials: the posterior without the declared prior."""
    names, reference, sizes = quantities.names, quantities.reference, quantities.sizes
    told = [k for k, name in enumerate(names) if _told(estimate, name)]
    rows = [estimate.parameters.index(names[k]) for k in told]
    items = [estimate.parameters[k] for k in rows]
    inverse = np.linalg.inv(estimate.covariance[np.ix_(rows, rows)])
    prior = np.array([item.prior_std for item in items]) ** -2.0
    value = np.array([item.coordinate(item.value) for item in items]) - reference[told]
    mean = np.array([i.coordinate(i.value if i.prior_mean is None else i.prior_mean) for i in items])
    matrix, vector = np.zeros((len(names), len(names))), np.zeros(len(names))
    matrix[np.ix_(told, told)] = (inverse - np.diag(prior)) * np.outer(sizes[told], sizes[told])
    vector[told] = (inverse @ value - prior * (mean - reference[told])) * sizes[told]
    return independent_combinations(matrix, vector, sizes)


def _friction_information(estimate: Estimate, quantities: _Quantities) -> Measured:
    """What torques tell of friction, all inertials integrated out without a prior."""
    names, reference, sizes = quantities.names, quantities.reference, quantities.sizes
    told = [k for k, name in enumerate(names) if _told(estimate, name)]
    rows = [estimate.parameters.index(names[k]) for k in told]
    value = np.array([estimate.values[names[k]] for k in told])
    log = np.array([quantities.scales[k] == "log" for k in told])
    slope = np.where(log, 1 / np.where(log, value, 1.0), 1.0)
    covariance = estimate.covariance[np.ix_(rows, rows)] * np.outer(slope, slope)
    inverse = np.linalg.inv(covariance)
    off = np.where(log, np.log(np.where(log, value, 1.0)), value) - reference[told]
    matrix, vector = np.zeros((len(names), len(names))), np.zeros(len(names))
    matrix[np.ix_(told, told)] = inverse * np.outer(sizes[told], sizes[told])
    vector[told] = inverse @ off * sizes[told]
    return independent_combinations(matrix, vector, sizes)


def _condition(member: Member, option: str) -> str:
    return member.estimate.provenance.get(f"option.{option}", "")


def _require_alike(members: Sequence[Member], what: str, option: str, said: str) -> None:
    if len(members) < FEWEST:
        raise FlexcalError(
            "E-PRIOR-013",
            f"the {what} of {len(members)} robots is identified, and {FEWEST} are needed to pool it; identify it of more robots.",
        )
    first = members[0]
    for member in members:
        member.require_model_of(first)
        if _condition(member, option) != _condition(first, option):
            raise FlexcalError(
                "E-PRIOR-014",
                f"the {what} of {first.name} was identified with the {said} {_condition(first, option)}, and that of {member.name} with "
                f"{_condition(member, option)}, so they mean different things; name the {said} in every robot.yaml, and identify again.",
            )
