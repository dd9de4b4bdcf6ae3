"""Fit of an axis of two or three masses to the spectra of whole records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from flexcal.elasticity.modal.fit import ModalFit
from flexcal.elasticity.modal.mass_chain import MassChain, synthesise
from flexcal.elasticity.modal.record_least_squares import (
    SMOOTH,
    BandData,
    FitCovariance,
    Projection,
    jacobian,
    pooled_covariance,
    sandwich,
    transient_basis,
)
from flexcal.elasticity.modal.resonance_intervals import LogValue, antiresonances, resonances

_EXPLAINED = 1.5
"""Mean square of the whitened errors, 1 expected, from which the weights treat the misfit as noise."""
_REWEIGHTED = 2
_FREE = 2.0
"""Prior standard deviation of the logarithms of damping and friction."""
_START_DAMPING = 0.02


@dataclass(frozen=True, eq=False)
class ChainFit:
    """Mass chain fitted to `data`, one output and one input; `prior` (p,) are the initial logarithms of damping and friction.

    criterion: Bayesian information criterion with the weights of the modal fit; smaller is better. mean_square: of the errors whitened with
    these weights, 1 expected.
    """

    data: BandData
    chain: MassChain
    prior: np.ndarray
    criterion: float
    mean_square: float

    @cached_property
    def uncertainty(self) -> FitCovariance:
        """Covariance (p, p) of log J, log k, log d, log b and the delay over the time step."""
        s, at = self.data.spectra, _parameters(self.data, self.chain)
        projection = _projection(self.data, self.chain)

        def predicted(steps: np.ndarray) -> np.ndarray:
            return (
                _chain(self.data, at + steps).response(s.frequencies_hz)[:, None]
                * s.instruments[:, :, 0, None]
            )

        derivative = jacobian(lambda z: predicted(z)[:, None, :, 0], np.zeros_like(at))
        rows = projection(derivative)
        errors = projection(_errors(self.data, self.chain, s.inputs))[..., 0]
        return sandwich(rows, errors, s.excited, projection, _information(at.size))

    def values(self) -> dict[str, LogValue]:
        """All parameters by name: inertia_1, stiffness_1, damping_1, …, viscous."""
        chain = self.chain
        std = np.sqrt(np.diag(self.uncertainty.covariance))
        names = [
            f"{kind}_{k + 1}"
            for kind, values in (
                ("inertia", chain.inertias),
                ("stiffness", chain.stiffnesses),
                ("damping", chain.dampings),
            )
            for k in range(len(values))
        ]
        estimates = np.exp(_parameters(self.data, chain)[:-1])
        freedom = self.uncertainty.degrees_of_freedom
        return {
            name: LogValue(float(value), float(one), freedom)
            for name, value, one in zip([*names, "viscous"], estimates, std, strict=False)
        }


def pairs(fit: ModalFit) -> list[tuple[float, float]]:
    """Antiresonance-resonance pairs (rad/s) of the first output to the first input where they alternate, the resonance above."""
    poles = [r.frequency_hz.estimate for r in resonances(fit) if r.frequency_hz.known]
    zeros = [r.frequency_hz.estimate for r in antiresonances(fit, 0, 0) if r.frequency_hz.known]
    alternating, low = [], 0.0
    for pole in poles:
        between = [zero for zero in zeros if low < zero < pole]
        if len(between) == 1:
            alternating.append((2 * np.pi * between[0], 2 * np.pi * pole))
        low = pole
    return alternating


def fit_chain(fit: ModalFit, masses: int, chosen: Sequence[tuple[float, float]]) -> ChainFit:
    """Fit a chain of `masses`, starting at the antiresonances and resonances `chosen` (rad/s), with data and weights of the modal fit."""
    data = _single(fit.data)
    zeros, poles = [z for z, _ in chosen], [p for _, p in chosen]
    unit = synthesise(1.0, poles, zeros) if chosen else MassChain(np.ones(1), np.zeros(0), np.zeros(0), 0.0)
    s = data.spectra
    reference = fit.model.response(s.frequencies_hz)[:, 0, 0]
    shape = unit.response(s.frequencies_hz)
    weight = np.abs(shape) / (np.abs(shape) ** 2 + np.median(np.abs(shape)) ** 2)
    scale = 1.0 / max(
        float(np.real(np.vdot(shape * weight, reference * weight)) / np.sum(np.abs(shape * weight) ** 2)),
        1e-3 * float(np.median(np.abs(reference / shape))),
    )
    inertias, stiffnesses = np.abs(unit.inertias) * scale, np.abs(unit.stiffnesses) * scale
    dampings = 2 * _START_DAMPING * stiffnesses / np.array(poles) if poles else np.zeros(0)
    start = MassChain(inertias, stiffnesses, dampings, 1e-2 * inertias.sum() * data.highest * 0.1)
    prior = _parameters(data, start)
    chain, cost = _fitted(data, start, prior)
    unknowns = prior.size + s.outputs.shape[0] * (SMOOTH + 2 * len(stiffnesses))
    criterion = 2 * cost + unknowns * float(np.log(data.rows))
    mean_square = 2 * cost / max(1, data.rows - unknowns)
    for _ in range(_REWEIGHTED if mean_square > _EXPLAINED else 0):
        data = _reweighted(data, chain)
        chain, _ = _fitted(data, chain, prior)
    return ChainFit(data, chain, prior, criterion, mean_square)


def _single(data: BandData) -> BandData:
    s = data.spectra
    return BandData(
        replace(
            s,
            inputs=s.inputs[:, :, :1],
            outputs=s.outputs[:, :, :1],
            instruments=s.instruments[:, :, :1],
            factor=s.factor[:, :1],
        ),
        data.sigma[:, :1],
    )


def _reweighted(data: BandData, chain: MassChain) -> BandData:
    """Data with the standard deviation of the chain's residual."""
    whitened = _projection(data, chain)(_errors(data, chain, data.spectra.inputs))[:, 0, :, 0]
    half = whitened.shape[1] // 2
    errors = (whitened[:, :half] + 1j * whitened[:, half:])[:, :, None] / np.sqrt(2.0)
    variance = np.real(pooled_covariance(errors, data.spectra.excited)[:, 0, 0])
    return BandData(data.spectra, data.sigma * np.sqrt(np.maximum(variance, 0.25))[:, None])


def _fitted(data: BandData, start: MassChain, prior: np.ndarray) -> tuple[MassChain, float]:
    at = _parameters(data, start)
    root = np.sqrt(_information(at.size))

    def residual(z: np.ndarray) -> np.ndarray:
        chain = _chain(data, z)
        whitened = _projection(data, chain)(_errors(data, chain, data.spectra.instruments))
        return np.concatenate([whitened.ravel(), (root * (z - prior))[root > 0]])

    bound = np.r_[np.full(at.size - 1, 12.0), 5.0]
    lower, upper = prior - bound, prior + bound
    solution = least_squares(
        residual, np.clip(at, lower + 1e-6, upper - 1e-6), bounds=(lower, upper), x_scale="jac", max_nfev=80
    )
    return _chain(data, solution.x), float(solution.cost)


def _errors(data: BandData, chain: MassChain, inputs: np.ndarray) -> np.ndarray:
    """Errors (R, 1, K, 1) of the chain."""
    s = data.spectra
    predicted = chain.response(s.frequencies_hz) * inputs[:, :, 0]
    return (s.outputs[:, :, 0] - predicted)[:, None, :, None]


def _projection(data: BandData, chain: MassChain) -> Projection:
    poles = chain.poles / data.highest
    upper = poles[poles.imag > 1e-9]
    of = np.stack([-2 * upper.real, np.abs(upper) ** 2], -1)
    slow = chain.viscous / chain.inertias.sum() / data.highest
    return Projection.of(data, transient_basis(data, slow, of))


def _parameters(data: BandData, chain: MassChain) -> np.ndarray:
    logs = [chain.inertias, chain.stiffnesses, chain.dampings, [chain.viscous]]
    return np.append(np.log(np.concatenate(logs)), chain.delay / data.spectra.time_step)


def _chain(data: BandData, z: np.ndarray) -> MassChain:
    masses = (len(z) + 1) // 3
    values = np.exp(z[:-1])
    springs = masses - 1
    return MassChain(
        values[:masses],
        values[masses : masses + springs],
        values[masses + springs : masses + 2 * springs],
        float(values[-1]),
        float(z[-1]) * data.spectra.time_step,
    )


def _information(size: int) -> np.ndarray:
    """Information of the prior: delay 0 ± one time step; damping and friction within an order of magnitude, in case they have no effect."""
    masses = (size + 1) // 3
    result = np.zeros(size)
    result[2 * masses - 1 :] = 1.0 / _FREE**2
    result[-1] = 1.0
    return result
