"""Weighted linear least squares with confidence intervals, common to the estimators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression import RegressionData, TriangularFactor, batch_covariance, stacked
from flexcal.errors import FlexcalError
from flexcal.estimation import Dropped, Estimate, Parameter, Parameters, analyse
from flexcal.model.robot import unit_in


def linear_fit(data: RegressionData, noise: Sequence[float]) -> Estimate:
    """Least squares of the subsystems, each divided by its `noise` (N m), with the base parameters as unknowns (Eqs. 2.29-2.31).

    Parameters that are no base parameters stay at the model's value, zero where it has none, and the kept ones absorb them. A base
    parameter that these data do not determine stays too and counts as dropped: the recording, not the robot, hides it. The covariance
    is that of `batch_covariance`, in place of (WᵀW)⁻¹ σ̂² (Eq. 2.30), which takes the errors for independent from row to row.
    Raises `FlexcalError` with no more rows than parameters.
    """
    system = weighted_system(data, noise)
    unknowns = Unknowns.of(data, system)
    kept, start = unknowns.kept, data.observation.values()
    factor, scale = unknowns.reduced(system)
    triangle, target = factor[:-1, :-1], factor[:-1, -1]
    parameters = start.copy()
    parameters[kept] += scale * np.linalg.solve(triangle, target)
    freedom = unknowns.freedom(system)
    cost = float(factor[-1, -1] ** 2)
    root = scale[:, None] * np.linalg.solve(triangle, np.eye(len(kept)))
    uncertainty = batch_covariance(data, noise, parameters, kept, root, cost / freedom)
    return unknowns.estimate(
        parameters, uncertainty.covariance, uncertainty.freedom, cost, freedom, "linear least squares"
    )


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Unknowns of a linear estimator: the `kept` columns (k,) of a system that does not determine the `hidden` base parameters."""

    data: RegressionData
    kept: list[int]
    hidden: tuple[Dropped, ...]

    @classmethod
    def of(cls, data: RegressionData, system: TriangularFactor) -> Unknowns:
        """Base parameters determined by a weighted `system` of all columns."""
        base = data.base.identifiability
        structural = [data.names[i] for i in base.kept]
        seen = analyse(system.matrix[:, base.kept], structural, prefer=structural)
        return cls(data, [base.kept[i] for i in seen.kept], seen.dropped)

    def reduced(self, system: TriangularFactor) -> tuple[np.ndarray, np.ndarray]:
        """Factor R (k + 1, k + 1) of the kept columns times a scale (k,), and of the residual of Y at the model's values; and that
        scale.
        """
        right = system.right - system.matrix @ self.data.observation.values()
        scale = 1.0 / np.linalg.norm(system.matrix[:, self.kept], axis=0)
        return TriangularFactor.of(system.matrix[:, self.kept] * scale, right).factor, scale

    def freedom(self, system: TriangularFactor) -> int:
        """Degrees of freedom, rows less parameters; raises `FlexcalError` if there are none."""
        freedom = system.rows - len(self.kept)
        if freedom <= 0:
            raise FlexcalError(
                "E-DYN-007",
                f"{system.rows} equations do not determine {len(self.kept)} parameters; record for longer.",
            )
        return freedom

    def estimate(
        self,
        parameters: np.ndarray,
        covariance: np.ndarray,
        covariance_freedom: float,
        cost: float,
        freedom: int,
        message: str,
        iterations: int = 1,
    ) -> Estimate:
        """Estimate of all `parameters` (p,), with the `covariance` (k, k) of the kept ones."""
        names, base, model = self.data.names, self.data.base.identifiability, self.data.observation.model
        whole = np.zeros((len(names), len(names)))
        whole[np.ix_(self.kept, self.kept)] = covariance
        seen = set(self.kept)
        return Estimate(
            parameters=Parameters(
                Parameter(name, unit_in(model, name), float(v))
                for name, v in zip(names, parameters, strict=True)
            ),
            covariance=whole,
            rank=len(self.kept),
            dropped=_dropped(base.regrouping, names, base.kept, self.hidden),
            identifiable=tuple(i in seen for i in range(len(names))),
            cost=cost,
            chi2=cost,
            degrees_of_freedom=freedom,
            status="converged",
            message=message,
            iterations=iterations,
            covariance_freedom=covariance_freedom,
        )


def weighted_system(data: RegressionData, noise: Sequence[float]) -> TriangularFactor:
    """All subsystems as one system of all columns, each divided by its `noise` (N m)."""
    weighted = [
        TriangularFactor(s.triangle.factor / sigma, s.triangle.rows)
        for s, sigma in zip(data.subsystems, noise, strict=True)
    ]
    return stacked(weighted, [s.column_indices for s in data.subsystems], len(data.names))


def _dropped(
    regrouping: np.ndarray, names: Sequence[str], base: Sequence[int], hidden: Sequence[Dropped]
) -> tuple[Dropped, ...]:
    """Regrouped parameters of the robot in terms of the determined base parameters, and those that the data do not determine."""
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
