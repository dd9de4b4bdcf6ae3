"""Maximum-likelihood fit of modal models to the spectra of whole records, with the number of modes by evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from flexcal.elasticity.modal.model import BACKGROUND, ModalModel, quadratics, response_basis
from flexcal.elasticity.modal.noise_shape import noise_shape
from flexcal.elasticity.modal.record_least_squares import (
    SMOOTH,
    BandData,
    FitCovariance,
    Projection,
    jacobian,
    sandwich,
    thinned,
    transient_basis,
    transients,
)
from flexcal.frequency.arbitrary import LocalResponse, RecordSpectra, local_response, local_window
from flexcal.progress import Progress, silent

MOST_MODES = 8
_TRIED_DAMPING = (0.01, 0.05)
_TRIED_FREQUENCIES = 25
_CANDIDATES = 4
_ROUNDS = 3
_FOR_CHOICE, _FOR_FIT = 1000, 8000
"""Largest number of bins of all records used to choose the modes, and for the final fit."""
_FIRST = np.array([np.log(1e-3), 0.0])
"""Initial values of log β, the pole of friction relative to the band's end, and delay."""
_SLOW_PRIOR = 0.05
"""Prior information on log β, which fixes it where friction has no effect."""
HEAVILY_DAMPED = 0.6
"""Damping ratio from which a term is no mode but a correction of the smooth background."""
_LOWEST_DAMPING, _HIGHEST_DAMPING = 1e-4, 0.95
_NARROWEST = 0.05
"""Half-width of a resonance, relative to the bin spacing, below which it is not distinguishable from a disturbance in one bin."""
_EVIDENT = 30.0
"""Squared ratio of a mode's numerators to their standard deviation (2 per element) from which it is in the response, not in transients
alone.
"""
_REACH = 1.3
"""Factor beyond the band's ends within which modes may lie."""


@dataclass(frozen=True, eq=False)
class ModalFit:
    """`model` fitted to `data`; `cost` is half the sum of squared whitened errors."""

    data: BandData
    model: ModalModel
    cost: float

    @property
    def unknowns(self) -> int:
        """Number of fitted real parameters, transients included."""
        records, _, n_y = self.data.spectra.outputs.shape
        modes = len(self.model.natural)
        return 2 * modes + 2 + self.model.numerators.size + records * n_y * (SMOOTH + 2 * modes)

    @property
    def criterion(self) -> float:
        """Bayesian information criterion; smaller is better."""
        return 2 * self.cost + self.unknowns * float(np.log(self.data.rows))

    @cached_property
    def parameters(self) -> np.ndarray:
        """log f_m, log ζ_m, log β, delay over the time step, numerators (p,)."""
        return np.concatenate([_nonlinear(self), self.model.numerators.ravel()])

    @property
    def is_evident(self) -> bool:
        """Whether every mode is significant in the response, not only in the transients of the records."""
        count = len(self.model.natural)
        covariance = self.uncertainty.likelihood
        first = 2 * count + 2
        at = first + np.arange(self.model.numerators.size).reshape(self.model.numerators.shape)
        for m in range(count):
            own = at[:, :, BACKGROUND + 2 * m : BACKGROUND + 2 * m + 2].ravel()
            values, block = self.parameters[own], covariance[np.ix_(own, own)]
            scale = np.sqrt(np.diag(block))
            if not (scale > 0).all():
                return False
            normal = np.linalg.lstsq(block / np.outer(scale, scale), values / scale, rcond=1e-9)[0]
            if float(values / scale @ normal) < _EVIDENT * own.size / 2:
                return False
        return True

    def moved(self, parameters: np.ndarray) -> ModalModel:
        """Model with other `parameters`."""
        m, count = self.model, len(self.model.natural)
        return ModalModel(
            m.highest,
            np.exp(parameters[:count]),
            np.exp(parameters[count : 2 * count]),
            float(np.exp(parameters[2 * count])),
            float(parameters[2 * count + 1]) * self.data.spectra.time_step,
            parameters[2 * count + 2 :].reshape(m.numerators.shape),
        )

    @cached_property
    def uncertainty(self) -> FitCovariance:
        """Covariance (p, p) of `parameters`."""
        s, count = self.data.spectra, len(self.model.natural)
        projection = Projection.of(
            self.data, transient_basis(self.data, self.model.slow, self.model.quadratics)
        )
        size = np.ones_like(self.parameters)
        numbers = self.model.numerators.ravel()
        size[2 * count + 2 :] = np.abs(numbers) + 1e-6 * np.abs(numbers).max()

        def predicted(steps: np.ndarray) -> np.ndarray:
            response = self.moved(self.parameters + steps * size).response(s.frequencies_hz)
            return np.einsum("kyu,rku->ryk", response, s.instruments)

        rows = projection(jacobian(predicted, np.zeros_like(size)))
        response = self.model.response(s.frequencies_hz)
        errors = np.moveaxis(s.outputs, 2, 1) - np.einsum("kyu,rku->ryk", response, s.inputs)
        prior = np.zeros_like(size)
        prior[2 * count : 2 * count + 2] = _SLOW_PRIOR, 1.0
        estimated = sandwich(rows, projection(errors[..., None])[..., 0], s.excited, projection, prior)
        outer = np.outer(size, size)
        return FitCovariance(
            estimated.covariance * outer, estimated.likelihood * outer, estimated.degrees_of_freedom
        )


@dataclass(frozen=True, eq=False)
class IdentifiedModes:
    """Fit with the selected number of modes, and the response measured about it, free of leakage at resonances."""

    fit: ModalFit
    response: LocalResponse


def identify_modes(
    spectra: RecordSpectra, measured: LocalResponse, *, modes: int | None = None, progress: Progress = silent
) -> IdentifiedModes:
    """Fit modal models with more and more modes until the Bayesian information criterion rises, or with `modes`.

    Errors are weighted by their scatter about the local response, which is estimated again about each model. Poles are common to all
    elements and to the transients of all records; numerators and transients are eliminated (variable projection,
    Golub and Pereyra 1973).
    """
    most = MOST_MODES if modes is None else modes
    response, sigma, fit = measured, _sigma(spectra, measured), None
    for turn in range(_ROUNDS):
        cleaned = _cleaned(spectra, response if fit is None else fit.model)
        data = thinned(BandData(cleaned, sigma), _FOR_CHOICE)
        before = 0 if fit is None else len(fit.model.natural)
        fit = _fitted(data, _FIRST if fit is None else _nonlinear(fit))
        while len(fit.model.natural) < most:
            progress("modes", (turn + len(fit.model.natural) / (most + 1)) / (_ROUNDS + 1))
            larger = _with_another(fit, response)
            if larger is None:
                break
            if modes is None and not (larger.criterion < fit.criterion and larger.is_evident):
                break
            fit = larger
            if modes is None and (fit.model.damping > HEAVILY_DAMPED).any():
                break
        response, sigma = _refined(spectra, fit.model, sigma)
        if len(fit.model.natural) == before:
            break
    assert fit is not None
    data = thinned(BandData(_cleaned(spectra, fit.model), sigma), _FOR_FIT)
    fit = _fitted(data, _nonlinear(fit))
    progress("modes", 1.0)
    return IdentifiedModes(fit, _refined(spectra, fit.model, sigma)[0])


def _cleaned(spectra: RecordSpectra, guess: LocalResponse | ModalModel) -> RecordSpectra:
    """Spectra with the instruments as inputs, and outputs less the effect of the inputs' remainder by an initial response.

    What a controller feeds back of the noise then is no error of the fit, which would look like modes.
    """
    if isinstance(guess, ModalModel):
        response = guess.response(spectra.frequencies_hz)
    else:
        lines = guess.response.reshape(len(guess.frequencies_hz), -1).T
        response = np.stack(
            [np.interp(spectra.frequencies_hz, guess.frequencies_hz, one) for one in lines], -1
        ).reshape(-1, *guess.response.shape[1:])
    rest = np.einsum("kyu,rku->rky", response, spectra.inputs - spectra.instruments)
    return replace(spectra, inputs=spectra.instruments, outputs=spectra.outputs - rest)


def refined_response(spectra: RecordSpectra, model: ModalModel, response: LocalResponse) -> LocalResponse:
    """Local response with a model and its transients as initial guess: only the remainder is smoothed over frequency.

    `response`: its scatter weights the transients' fit; the records may be others than those it was measured from.
    """
    return _refined(spectra, model, _sigma(spectra, response))[0]


def _refined(
    spectra: RecordSpectra, model: ModalModel, sigma: np.ndarray
) -> tuple[LocalResponse, np.ndarray]:
    """Refined response with weights by `sigma` (K, n_y), and the standard deviation (K, n_y) of the outputs about it."""
    guessed = model.response(spectra.frequencies_hz)
    rest = spectra.outputs - np.einsum("kyu,rku->rky", guessed, spectra.inputs)
    data = BandData(spectra, sigma)
    rest = rest - transients(data, transient_basis(data, model.slow, model.quadratics), rest)
    shape = noise_shape(rest, guessed, spectra.excited, local_window(spectra))
    local = local_response(replace(spectra, outputs=rest), shape)
    response = local.response + model.response(local.frequencies_hz)
    diagonal = np.real(np.diagonal(local.scatter, axis1=1, axis2=2))
    refined = replace(local, response=response, coherence=_coherence(spectra, local, response, diagonal))
    return refined, _sigma(spectra, local, shape)


def _coherence(
    spectra: RecordSpectra, local: LocalResponse, response: np.ndarray, scatter: np.ndarray
) -> np.ndarray:
    """Multiple coherence (L, n_y): share of the outputs' power at the lines, pooled over the window, explained by the response."""
    from flexcal.frequency.periodic import pool_noise

    at = np.searchsorted(spectra.frequencies_hz, local.frequencies_hz - 1e-9)
    lines = np.flatnonzero(spectra.excited)
    every = np.stack(
        [
            np.interp(spectra.frequencies_hz[lines], local.frequencies_hz, element)
            for element in response.reshape(len(at), -1).T
        ],
        -1,
    ).reshape(len(lines), *response.shape[1:])
    power = (np.abs(np.einsum("kyu,rku->rky", every, spectra.inputs[:, lines])) ** 2).mean(0)
    count = max(1, round(local.correlated_hz / spectra.resolution_hz * len(lines) / len(spectra.excited)))
    power = pool_noise(power, lines, at, count)
    return power / np.maximum(power + scatter, np.finfo(float).tiny)


def _sigma(spectra: RecordSpectra, response: LocalResponse, shape: np.ndarray | None = None) -> np.ndarray:
    """Standard deviation (K, n_y) of the outputs at every bin, from the scatter at the lines relative to a `shape` (K,)."""
    every = np.ones(len(spectra.frequencies_hz)) if shape is None else shape
    own = np.interp(response.frequencies_hz, spectra.frequencies_hz, every)
    variance = np.real(np.diagonal(response.scatter, axis1=1, axis2=2)) / own[:, None] ** 2
    floor = 1e-20 * variance.max(0) + np.finfo(float).tiny
    logs = np.log(np.maximum(variance, floor))
    between = [np.interp(spectra.frequencies_hz, response.frequencies_hz, column) for column in logs.T]
    return every[:, None] * np.exp(0.5 * np.stack(between, -1))


def _nonlinear(fit: ModalFit) -> np.ndarray:
    """Nonlinear parameters: log f_m, log ζ_m, log β, delay over the time step."""
    m = fit.model
    rest = [np.log(m.slow), m.delay / fit.data.spectra.time_step]
    return np.concatenate([np.log(m.natural), np.log(m.damping), rest])


def _fitted(data: BandData, start: np.ndarray) -> ModalFit:
    """Best fit near `start`: log f_m, log ζ_m, log β, delay over the time step."""
    count = len(start) // 2 - 1
    low = data.spectra.frequencies_hz[0] / data.spectra.frequencies_hz[-1]
    lower = [
        *[np.log(low / _REACH)] * count,
        *[np.log(_least_damping(data))] * count,
        np.log(1e-4 * low),
        -5.0,
    ]
    upper = [*[np.log(_REACH)] * count, *[np.log(_HIGHEST_DAMPING)] * count, np.log(low), 5.0]
    inside = np.clip(start, np.add(lower, 1e-6), np.subtract(upper, 1e-6))
    solution = least_squares(
        lambda z: _reduced(data, z)[0],
        inside,
        bounds=(lower, upper),
        x_scale="jac",
        max_nfev=40,
        ftol=1e-7,
        xtol=1e-8,
    )
    order = np.argsort(solution.x[:count])
    z = np.concatenate(
        [solution.x[:count][order], solution.x[count : 2 * count][order], solution.x[2 * count :]]
    )
    rest, numerators = _reduced(data, z)
    natural, damping, slow = np.exp(z[:count]), np.exp(z[count : 2 * count]), float(np.exp(z[-2]))
    model = ModalModel(
        data.highest, natural, damping, slow, float(z[-1]) * data.spectra.time_step, numerators
    )
    return ModalFit(data, model, 0.5 * float(rest @ rest))


def _least_damping(data: BandData) -> float:
    return max(_LOWEST_DAMPING, _NARROWEST * data.spectra.resolution_hz / data.spectra.frequencies_hz[-1])


def _reduced(data: BandData, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whitened errors with the best numerators for given poles and delay, and these numerators (n_y, n_u, 4 + 2M)."""
    count = len(z) // 2 - 1
    s, x = data.spectra, data.x
    records, bins, n_u = s.instruments.shape
    of, slow = quadratics(np.exp(z[:count]), np.exp(z[count : 2 * count])), float(np.exp(z[-2]))
    projection = Projection.of(data, transient_basis(data, slow, of))
    lag = np.exp(-x * data.highest * s.time_step * z[-1])
    shapes = response_basis(x, slow, of) * lag[:, None]
    inputs = (s.instruments[..., None] * shapes[:, None, :]).reshape(records, 1, bins, -1)
    n_y = s.outputs.shape[2]
    regressors = projection(np.broadcast_to(inputs, (records, n_y, *inputs.shape[2:])))
    outputs = projection(np.moveaxis(s.outputs, 2, 1)[..., None])[..., 0]
    rest, numerators = [], []
    for y in range(n_y):
        rows = regressors[:, y].reshape(-1, regressors.shape[-1])
        seen = outputs[:, y].ravel()
        scale = np.linalg.norm(rows, axis=0)
        q, r = np.linalg.qr(rows / scale)
        projected = q.T @ seen
        rest.append(seen - q @ projected)
        numerators.append((np.linalg.solve(r, projected) / scale).reshape(n_u, BACKGROUND + 2 * count))
    prior_rows = [(z[-2] - _FIRST[0]) * np.sqrt(_SLOW_PRIOR), z[-1]]
    return np.concatenate([*rest, prior_rows]), np.stack(numerators)


def _with_another(fit: ModalFit, response: LocalResponse) -> ModalFit | None:
    """Best fit with one more mode, initialised where it helps most; None for too few data, or if it is a disturbance in single bins."""
    data, at, count = fit.data, _nonlinear(fit), len(fit.model.natural)
    if fit.unknowns + 8 * data.spectra.outputs.shape[0] > 0.7 * data.rows:
        return None
    tried = []
    for frequency in _tried(data, response):
        for damping in _TRIED_DAMPING:
            extended = np.insert(at, [count, 2 * count], np.log([frequency, damping]))
            rest, _ = _reduced(data, extended)
            tried.append((float(rest @ rest), extended))
    tried.sort(key=lambda item: item[0])
    chosen: dict[float, np.ndarray] = {}
    for _, extended in tried:
        chosen.setdefault(float(extended[count]), extended)
    fits = [_fitted(data, extended) for extended in list(chosen.values())[:_CANDIDATES]]
    fits = [one for one in fits if (one.model.damping > 1.05 * _least_damping(data)).all()]
    return min(fits, key=lambda one: one.cost, default=None)


def _tried(data: BandData, response: LocalResponse) -> np.ndarray:
    """Trial frequencies, relative to the band's end: a grid, and the peaks of the measured magnitudes."""
    end = data.spectra.frequencies_hz[-1]
    grid = np.geomspace(max(data.spectra.frequencies_hz[0], 0.02 * end), end, _TRIED_FREQUENCIES) / end
    magnitude = np.abs(response.response).max((1, 2))
    inner = magnitude[1:-1]
    peaks = np.flatnonzero((inner > magnitude[:-2]) & (inner > magnitude[2:])) + 1
    highest = peaks[np.argsort(magnitude[peaks])[-6:]]
    return np.concatenate([grid, response.frequencies_hz[highest] / end])
