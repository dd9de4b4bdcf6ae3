"""Drive gains from recordings with and without a payload of known mass, by instrumental variables (Gautier & Briot 2014)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators import InstrumentalFit, instrumental_fit, noise_levels
from flexcal.dynamics.regression import Batch, RegressionData, TriangularFactor, triangular
from flexcal.errors import FlexcalError
from flexcal.estimation import Dropped, Estimate, Parameter, Parameters, analyse
from flexcal.model.parts import LINK_PARAMETERS

_SETTLED = 1e-6
"""Largest relative change of a gain at which the iteration has converged."""
_ITERATIONS = 100


def drive_gains(data: RegressionData, payloads: Sequence[float]) -> Estimate:
    """Identify drive gains, as factors `<joint>.drive_gain` to the logged torques, from a payload of known mass.

    `payloads` (kg, one an experiment, 0 or that of the one payload) hang on the link that robot.yaml's payload hangs on; of it the mass is
    taken as known, and its first moments and inertia are estimated beside the robot's base parameters. The equations
    W χ + W_p χ_p − k τ = −m w_m have the noise of the torque in a column, which least squares would take from the gains; its instrument is
    the torque that the estimate predicts, renewed until the gains settle. A gain whose 95 % interval reaches zero is not identifiable: the
    payload's share drowns. One below zero turns the sign of what was measured. Raises `FlexcalError` without a declared payload, where
    all or no experiments carry one, or several, as `noise_levels` and `instrumental_fit` do, and where the gains do not settle.
    """
    payload, names = data.observation.model.payload, data.observation.model.joint_names
    if payload is None or not any(payloads) or all(payloads):
        raise FlexcalError(
            "E-DYN-001",
            "drive gains need recordings both with and without the payload that robot.yaml declares.",
        )
    masses = sorted({mass for mass in payloads if mass > 0})
    if len(masses) > 1:
        raise FlexcalError(
            "E-DYN-002",
            f"payloads of {masses[0]:g} and {masses[1]:g} kg are two payloads with different centres of mass and inertias; give "
            "recordings of one payload.",
        )
    terms = _Terms(data, payloads, payload.joint)
    noise = noise_levels(data)
    kept = terms.determined(noise)
    values = _settled(terms, noise, kept)
    fit = terms.fit(data.batches, values, noise, kept)
    gains = terms.gains
    covariance = np.zeros((len(fit.values), len(fit.values)))
    covariance[np.ix_(kept, kept)] = fit.covariance.covariance
    covariance = covariance[gains, gains]
    parameters = [
        Parameter(gain_name(name), "1", float(v)) for name, v in zip(names, fit.values[gains], strict=True)
    ]
    estimate = Estimate(
        parameters=Parameters(parameters),
        covariance=covariance,
        rank=len(names),
        dropped=(),
        identifiable=(True,) * len(names),
        cost=fit.cost,
        chi2=fit.cost,
        degrees_of_freedom=sum(s.triangle.rows for s in data.subsystems) - len(kept),
        status="converged",
        message=f"instrumental variables; their weakest correlation with the columns is {fit.weakest:.3g}",
        iterations=1,
        covariance_freedom=fit.covariance.freedom,
    )
    told = [_without_zero(estimate.interval(name)) for name in estimate.parameters.names]
    return replace(
        estimate,
        rank=sum(told),
        identifiable=tuple(told),
        dropped=tuple(
            Dropped(name, ()) for name, seen in zip(estimate.parameters.names, told, strict=True) if not seen
        ),
    )


def gain_name(joint: str) -> str:
    """Name of the parameter that scales a joint's torques."""
    return f"{joint}.drive_gain"


def _without_zero(interval: tuple[float, float] | None) -> bool:
    return interval is not None and interval[0] * interval[1] > 0.0


def _settled(terms: _Terms, noise: Sequence[float], kept: Sequence[int]) -> np.ndarray:
    values = terms.least_squares(noise, kept)
    for _ in range(_ITERATIONS):
        before, values = values[terms.gains], terms.fit(terms.whole, values, noise, kept).values
        if np.all(np.abs(values[terms.gains] - before) <= _SETTLED * np.abs(before)):
            return values
    raise FlexcalError(
        "E-DYN-003",
        f"the drive gains do not converge in {_ITERATIONS} steps; record for longer, or with a heavier payload.",
    )


class _Terms:
    """Columns of the equations: base parameters of the robot, payload without its mass, gains; the same for all joints."""

    def __init__(self, data: RegressionData, payloads: Sequence[float], link: int) -> None:
        self.data, self._payloads = data, payloads
        self._base = list(data.base.identifiability.kept)
        first = len(LINK_PARAMETERS) * link
        self._mass, self._rest = first, list(range(first + 1, first + len(LINK_PARAMETERS)))
        n = data.observation.model.n
        self._width = len(self._base) + len(self._rest) + n
        self.gains = slice(self._width - n, self._width)

    @property
    def whole(self) -> list[tuple[Batch]]:
        """Equations with every experiment as one batch: sufficient for values, not for their covariance."""
        by_experiment: dict[int, list[TriangularFactor]] = {}
        for s in self.data.subsystems:
            by_experiment.setdefault(s.experiment, []).append(s.triangle)
        return [(Batch(0, own[0].rows, tuple(t.factor for t in own)),) for own in by_experiment.values()]

    def fit(
        self,
        experiments: Sequence[Sequence[Batch]],
        values: np.ndarray,
        noise: Sequence[float],
        kept: Sequence[int],
    ) -> InstrumentalFit:
        """Instrumental-variable fit with the torques predicted by `values` (width,) as instruments of the measured ones."""
        column_indices = [np.arange(self._width)] * self.data.observation.model.n
        batches = self._mapped(experiments, values)
        return instrumental_fit(batches, column_indices, noise, np.zeros(self._width), kept)

    def least_squares(self, noise: Sequence[float], kept: Sequence[int]) -> np.ndarray:
        """Initial values (width,) by least squares."""
        system = self._system(noise)
        solution = np.zeros(self._width)
        scale = 1.0 / np.linalg.norm(system[:, kept], axis=0)
        solution[kept] = scale * np.linalg.lstsq(system[:, kept] * scale, system[:, -1], rcond=None)[0]
        return solution

    def determined(self, noise: Sequence[float]) -> list[int]:
        """Numbers of the columns that the data determine."""
        names = [str(number) for number in range(self._width)]
        return sorted(analyse(self._system(noise)[:, :-1], names, prefer=names[::-1]).kept)

    def _system(self, noise: Sequence[float]) -> np.ndarray:
        n, stack = self.data.observation.model.n, []
        for number, batches in enumerate(self._mapped(self.whole, np.zeros(self._width))):
            for joint in range(n):
                rows = np.vstack([batch.factors[joint] for batch in batches])[:, self._width :]
                stack.append(triangular(rows / noise[number * n + joint]))
        return triangular(np.vstack(stack))

    def _mapped(self, experiments: Sequence[Sequence[Batch]], values: np.ndarray) -> list[list[Batch]]:
        mapped = []
        for batches, mass in zip(experiments, self._payloads, strict=True):
            maps = [self._map(joint, mass, values) for joint in range(self.data.observation.model.n)]
            mapped.append(
                [
                    replace(batch, factors=tuple(f @ m for f, m in zip(batch.factors, maps, strict=True)))
                    for batch in batches
                ]
            )
        return mapped

    def _map(self, joint: int, mass: float, values: np.ndarray) -> np.ndarray:
        """Matrix (m + 1, 2 width + 1) from a joint's [W, Y] in one experiment to instruments, columns and right-hand side."""
        column_indices = self.data.observation.column_indices[joint]
        place = {number: row for row, number in enumerate(column_indices)}
        columns = np.zeros((len(column_indices) + 1, self._width + 1))
        loaded = self._rest if mass > 0 else []
        for column, number in enumerate((*self._base, *loaded)):
            if number in place:
                columns[place[number], column] = 1.0
        gain = self.gains.start + joint
        columns[-1, gain] = -1.0
        if self._mass in place:
            columns[place[self._mass], -1] = -mass
        instruments = columns[:, :-1].copy()
        others = np.where(np.arange(self._width) < self.gains.start, values, 0.0)
        instruments[:, gain] = columns[:, -1] - instruments @ others
        return np.hstack([instruments, columns])
