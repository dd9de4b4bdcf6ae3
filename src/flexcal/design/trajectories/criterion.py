"""Criterion of an exciting trajectory, given prior information."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.design.optimality import (
    ConditionNumberCriterion,
    Criterion,
    DOptimal,
    SmoothMinimumEigenvalue,
    TraceOptimal,
)
from flexcal.design.trajectories.regressor_columns import DRIVE, BaseRegressor
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel, declared_parameter, uncertain_inertials

TrajectoryCriterion = Literal["compound", "condition", "D", "E", "A", "posterior", "c"]
_STEP = 1e-4
_SEEN = 1e-6
"""Largest share of an unknown that may lie in the null space of torques and prior."""
_FAINT = 1e-9
"""Negligible information on a scaled base parameter, so that one unidentifiable at a resting joint does not stop a search."""
CONDITIONING = 0.3
"""Weight of -log cond(W) in the compound criterion, relative to log det per parameter: for a tenth more standard deviation of each,
condition numbers of 5 in place of 15 to 90.
"""
_CONDITION = ConditionNumberCriterion()


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Unknowns with `names` (p,): base columns = `directions` (r, p) times them, in units in which `prior` (p, p) is their information."""

    names: tuple[str, ...]
    directions: np.ndarray
    prior: np.ndarray

    def information(self, base: np.ndarray) -> np.ndarray:
        """Information (p, p) from that on the base columns (r, r), with the prior."""
        return self.directions.T @ base @ self.directions + self.prior


@dataclass(frozen=True, eq=False)
class ExcitationCriterion:
    """A criterion of unknowns after `gathered` information (r, r) on the base columns, and `instants` of a new motion.

    The merit is that of the criterion and, `conditioning` times, -log cond(W) of the base columns: with both, a compound criterion
    (Atkinson, Donev & Tobias 2007, ch. 21).
    """

    criterion: Criterion
    unknowns: Unknowns
    gathered: np.ndarray
    instants: float
    conditioning: float = 0.0

    def total(self, information: np.ndarray) -> np.ndarray:
        """Information (r, r) on the base columns with a motion whose instants add `information` on average."""
        return self.gathered + self.instants * information

    def merit(self, information: np.ndarray) -> float:
        total = self.total(information)
        merit = self.criterion.merit(self.unknowns.information(total))
        return merit + self.conditioning * _CONDITION.merit(total) if self.conditioning else merit

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """Derivative (r, r) of the merit by the mean information of an instant."""
        total = self.total(information)
        slope = self.criterion.gradient(self.unknowns.information(total))
        directions = self.unknowns.directions
        by_total = directions @ slope @ directions.T
        if self.conditioning:
            by_total += self.conditioning * _CONDITION.gradient(total)
        return self.instants * by_total

    def about(self, requested: Sequence[str]) -> ExcitationCriterion:
        """Criterion for some of the unknowns only, the others eliminated (Ds-optimality)."""
        return replace(self, criterion=MarginalD(np.isin(self.unknowns.names, list(requested))))

    def after(self, information: np.ndarray) -> ExcitationCriterion:
        """Criterion for the next motion."""
        return replace(self, gathered=self.total(information))


@dataclass(frozen=True, eq=False)
class MarginalD:
    """Ds-optimality: log det of the information on the `requested` unknowns, the others eliminated, per unknown."""

    requested: np.ndarray
    name: str = "D"
    uses_prior: bool = True

    def merit(self, information: np.ndarray) -> float:
        sign, value = np.linalg.slogdet(information)
        other = np.linalg.slogdet(information[np.ix_(~self.requested, ~self.requested)])[1]
        return float(value - other) / max(int(self.requested.sum()), 1) if sign > 0 else -np.inf

    def gradient(self, information: np.ndarray) -> np.ndarray:
        slope = np.linalg.inv(information)
        slope[np.ix_(~self.requested, ~self.requested)] -= np.linalg.inv(
            information[np.ix_(~self.requested, ~self.requested)]
        )
        return slope / max(int(self.requested.sum()), 1)


def excitation_criterion(
    columns: BaseRegressor,
    criterion: TrajectoryCriterion,
    of: Sequence[str],
    sizes: np.ndarray,
    instants: float,
) -> ExcitationCriterion:
    """Criterion for the first motion; `sizes` (r,) of the base columns are the units of D, E and A.

    condition, D, E and A are of the base parameters without prior; posterior (D) and c (the variances of the parameters `of`, which get
    no prior) of masses, centres of mass and drives with that of robot.yaml; compound is posterior and condition. Raises `InputError` for
    names that the torques cannot tell.
    """
    nothing = np.zeros((columns.rank, columns.rank))
    if bool(of) != (criterion == "c"):
        raise InputError(
            "E-DESIGN-041",
            "name the parameters that the criterion c is of, and only for c; for example --criterion c --of link_3.mass.",
        )
    faint = _FAINT * np.eye(columns.rank)
    if criterion in ("compound", "posterior", "c"):
        unknowns = declared_unknowns(columns, tuple(of))
        if criterion == "c":
            _require_visible(columns, unknowns, of)
            chosen = np.isin(unknowns.names, list(of)).astype(float)
            return ExcitationCriterion(TraceOptimal(np.diag(chosen), "c"), unknowns, nothing, instants)
        requested = np.array([name.rpartition(".")[2] not in DRIVE[1:] for name in unknowns.names])
        if criterion == "posterior":
            return ExcitationCriterion(MarginalD(requested, criterion), unknowns, nothing, instants)
        return ExcitationCriterion(
            MarginalD(requested, criterion), unknowns, faint * np.outer(sizes, sizes), instants, CONDITIONING
        )
    names = columns.identifiability.kept_names
    if criterion == "condition":
        return ExcitationCriterion(
            ConditionNumberCriterion(), Unknowns(names, np.eye(columns.rank), nothing), nothing, instants
        )
    of_base = Unknowns(names, np.diag(1 / sizes), faint)
    kinds: dict[str, Criterion] = {
        "D": DOptimal(),
        "E": SmoothMinimumEigenvalue(),
        "A": TraceOptimal(np.eye(columns.rank), "A"),
    }
    return ExcitationCriterion(kinds[criterion], of_base, nothing, instants)


def declared_unknowns(columns: BaseRegressor, free: tuple[str, ...] = ()) -> Unknowns:
    """Unknowns with robot.yaml's prior, in units of its standard deviations, then friction and the parameters `free`, without one."""
    model = columns.model
    names = uncertain_inertials(model, range(model.n))
    names += [
        f"{joint}.rotor_inertia"
        for joint, value in zip(model.joint_names, model.drives.rotor_inertia, strict=True)
        if value > 0
    ]
    names += [f"{joint}.{key}" for key in DRIVE[1:] for joint in model.joint_names]
    payload = model.payload
    if payload is not None and payload.mass_std > 0 and columns.payload is None:
        names.append("payload.mass")
    names += [name for name in free if name not in names]
    known = np.array([name not in free and _has_prior(model, name) for name in names])
    directions = np.column_stack([_direction(columns, name) for name in names])
    return Unknowns(
        tuple(names), columns.identifiability.regrouping @ directions, np.diag(known.astype(float))
    )


def _has_prior(model: RobotModel, name: str) -> bool:
    """Whether robot.yaml's prior covers the parameter; friction and torque offsets have none, and may have no value."""
    return name.rpartition(".")[2] not in DRIVE[1:] and bool(
        np.isfinite(declared_parameter(model, name).prior_std)
    )


def _direction(columns: BaseRegressor, name: str) -> np.ndarray:
    """Change (p,) of all columns' values by one prior standard deviation of a parameter, or by one of its coordinate without prior."""
    if name in columns.identifiability.names and name.rpartition(".")[2] in DRIVE[1:]:
        return np.eye(len(columns.identifiability.names))[columns.identifiability.names.index(name)]
    model: RobotModel = columns.model
    item = declared_parameter(model, name)
    size = item.prior_std if np.isfinite(item.prior_std) else 1.0
    ends = [item.natural(item.coordinate(item.value) + sign * _STEP * size) for sign in (1, -1)]
    above, below = (replace(columns, model=model.with_values({name: end})).values for end in ends)
    return (above - below) / (2 * _STEP)


def _require_visible(columns: BaseRegressor, unknowns: Unknowns, of: Sequence[str]) -> None:
    stacked = np.vstack([unknowns.directions, unknowns.prior])
    norms = np.maximum(np.linalg.norm(stacked, axis=0), 1e-300)
    _, sizes, right = np.linalg.svd(stacked / norms)
    open_ways = right[np.sum(sizes > 1e-9 * sizes[0]) :] if len(sizes) else right
    hidden = open_ways.T @ open_ways
    for name in of:
        place = unknowns.names.index(name)
        if np.linalg.norm(stacked[:, place]) == 0 or hidden[place, place] > _SEEN:
            others = [
                unknowns.names[k]
                for k in np.argsort(-np.abs(hidden[place]))
                if k != place and abs(hidden[place, k]) > 0.05 * abs(hidden[place, place])
            ]
            how = f"only together with {', '.join(others[:5])}" if others else "not at all"
            raise InputError(
                "E-DESIGN-042",
                f"the criterion is about {name}, which torques determine {how}; choose another parameter, or give a prior to the others.",
            )
