"""The weighted linear least squares that the estimators share, and the estimate it gives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.dynamics.batch_covariance import batch_covariance
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.triangle import Triangle, stacked
from flexcal.errors import FlexcalError
from flexcal.estimation import Dropped, Estimate, Parameter, Parameters, analyse
from flexcal.model.names import unit_of


def linear_fit(data: RegressionData, noise: Sequence[float]) -> Estimate:
    """Least squares of the subsystems, each divided by its `noise` (N m), with the base parameters as unknowns (Eqs. 2.29-2.31).

    Parameters that are no base parameters stay at the model's value, zero where it has none, and the kept ones absorb them. A base
    parameter that these data do not determine stays too and counts as dropped: the recording, not the robot, hides it. The covariance
    is that of `batch_covariance`, in place of (WᵀW)⁻¹ σ̂² (Eq. 2.30), which takes the errors for independent from row to row.
    Raises `FlexcalError` with no more rows than parameters.
    """
    names = data.names
    system = weighted_system(data, noise)
    base = data.base.found
    structural = [names[i] for i in base.kept]
    seen = analyse(system.matrix[:, base.kept], structural, prefer=structural)
    kept = [base.kept[i] for i in seen.kept]
    start = data.observation.values()
    right = system.right - system.matrix @ start
    scale = 1.0 / np.linalg.norm(system.matrix[:, kept], axis=0)
    factor = Triangle.of(system.matrix[:, kept] * scale, right).factor
    triangle, target = factor[:-1, :-1], factor[:-1, -1]
    found = start.copy()
    found[kept] += scale * np.linalg.solve(triangle, target)
    freedom = system.rows - len(kept)
    if freedom <= 0:
        raise FlexcalError(
            f"{system.rows} equations do not determine {len(kept)} parameters; record for longer."
        )
    cost = float(factor[-1, -1] ** 2)
    root = scale[:, None] * np.linalg.solve(triangle, np.eye(len(kept)))
    spread = batch_covariance(data, noise, found, kept, root, cost / freedom)
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(kept, kept)] = spread.covariance
    return Estimate(
        parameters=Parameters(
            Parameter(name, unit_of(name), float(v)) for name, v in zip(names, found, strict=True)
        ),
        covariance=covariance,
        rank=len(kept),
        dropped=_dropped(base.regrouping, names, base.kept, seen.dropped),
        identifiable=tuple(i in set(kept) for i in range(len(names))),
        cost=cost,
        chi2=cost,
        degrees_of_freedom=freedom,
        status="converged",
        message="linear least squares",
        iterations=1,
        covariance_freedom=spread.freedom,
    )


def weighted_system(data: RegressionData, noise: Sequence[float]) -> Triangle:
    """All subsystems as one system of all columns, each divided by its `noise` (N m)."""
    weighted = [
        Triangle(s.triangle.factor / sigma, s.triangle.rows)
        for s, sigma in zip(data.subsystems, noise, strict=True)
    ]
    return stacked(weighted, [s.members for s in data.subsystems], len(data.names))


def _dropped(
    regrouping: np.ndarray, names: Sequence[str], base: Sequence[int], hidden: Sequence[Dropped]
) -> tuple[Dropped, ...]:
    """What the robot regroups, in terms of the base parameters that the data determine, and what the data hide besides."""
    onward = {entry.name: entry.absorbed_by for entry in hidden}
    result: list[Dropped] = list(hidden)
    for number, name in enumerate(names):
        if number in base:
            continue
        shares: dict[str, float] = {}
        for kept, coefficient in zip(base, regrouping[:, number], strict=True):
            for heir, share in onward.get(names[kept], ((names[kept], 1.0),)):
                shares[heir] = shares.get(heir, 0.0) + coefficient * share
        absorbed = tuple((heir, share) for heir, share in shares.items() if share != 0.0)
        result.append(Dropped(name, absorbed))
    return tuple(result)
