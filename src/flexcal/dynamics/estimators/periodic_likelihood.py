"""Maximum likelihood for periodic excitation: noise of torques and motion from the differences between periods (Swevers 1997)."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import digamma, polygamma

from flexcal.dynamics.estimators.linear_least_squares import Unknowns
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.wls import weighted_least_squares
from flexcal.dynamics.inverse_model import Memory, Observation
from flexcal.dynamics.regression import RegressionData, TriangularFactor, mixed_covariance
from flexcal.dynamics.signals import Motion, RepeatedMotion, real_rows
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate


def physical_memory() -> int | None:
    """Size of the physical memory, bytes; None if unknown."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


def moderated(variances: np.ndarray, freedom: float) -> tuple[np.ndarray, float]:
    """Inverse posterior means of the precisions (k,), and their degrees of freedom.

    Each of the `variances` (k,) has so many degrees of `freedom`. The true ones have an inverse chi-squared prior, whose level and
    degrees of freedom come from the mean and the variance of the logarithms (Smyth 2004, Eqs. 2, 5 and 6); these are at most those of all
    `variances` together, which a common one would have.
    """
    if len(variances) == 1:
        return variances, freedom
    most = (len(variances) - 1) * freedom
    logs = np.log(np.maximum(variances, np.finfo(float).tiny))
    excess = np.var(logs, ddof=1) - float(polygamma(1, freedom / 2))
    if excess <= float(polygamma(1, most / 2)):
        prior = most
    else:
        prior = 2 * float(
            root_scalar(lambda half: float(polygamma(1, half)) - excess, bracket=(1e-6, most / 2)).root
        )
    level = np.exp(
        np.mean(logs) - digamma(freedom / 2) + np.log(freedom / 2) + digamma(prior / 2) - np.log(prior / 2)
    )
    return (prior * level + freedom * variances) / (prior + freedom), prior + freedom


_REACH = 5
"""Number of neighbouring lines on either side from which the noise of a line is estimated."""
_CORNERS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, np.inf)
"""Corner lines of first-order noise, at which its power has fallen by half; the last is white."""
_SMALLEST = 1e-9
"""Lower bound of the noise of exactly fitted torques, relative to them."""
_SETTLED = 1e-2
"""Largest step of a parameter, in its standard deviations, at which the iteration has converged."""
_ITERATIONS = 20
_HELD = 100
"""Memory, bytes per sample and joint, of periods averaged, filtered and differentiated together; 97 were measured."""
_BLOCK = 512
"""Number of samples whose columns are in memory at once."""


def maximum_likelihood(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ from the mean period of every experiment, its torques weighted by their covariance over lines and joints.

    Rows are Fourier coefficients up to the band of the decimated rows. The noise of torque and motion acts together in τ − W(q) χ, whose
    scatter between the periods is therefore what likelihood asks for, to first order in the noise; it is read anew with every χ, as
    the noise of the motion goes through the parameters. W is that of the mean motion: averaging takes the noise out before it can bend W.
    Lines are weighed as if their errors were independent, but noise of the motion at few lines is in many of the torques: the covariance
    is that of the scores, from their scatter between the periods (`_covariance`), raised by the mean squared error of the weighted rows
    where the model misses more than the noise. Standstill is not masked. Raises `FlexcalError` as `RepeatedMotion.of` and
    `weighted_least_squares` do, where the steps do not settle, and for motions that the machine's memory cannot hold.
    """
    _require_memory(recorded)
    motions = [
        RepeatedMotion.of(experiment, window)
        for experiment, window in zip(recorded.experiments, recorded.windows, strict=True)
    ]
    observation, factor = recorded.observation, recorded.decimation.factor
    means = [_mean_rows(observation, motion, factor) for motion in motions]
    parameters = weighted_least_squares(data).parameters.coordinates()
    for iteration in range(1, _ITERATIONS + 1):
        missed = [_residuals(observation, motion, parameters, factor) for motion in motions]
        roots = [_root(_scatter(own), rows) for own, rows in zip(missed, means, strict=True)]
        parts = [_whitened(rows, root) for rows, root in zip(means, roots, strict=True)]
        stack = np.concatenate(parts)
        system = TriangularFactor.of(stack[:, :-1], stack[:, -1])
        unknowns = Unknowns.of(data, system)
        before, kept = parameters, unknowns.kept
        triangle, scale = unknowns.reduced(system)
        parameters = observation.values()
        parameters[kept] += scale * np.linalg.solve(triangle[:-1, :-1], triangle[:-1, -1])
        freedom, cost = unknowns.freedom(system), float(triangle[-1, -1] ** 2)
        root = scale[:, None] * np.linalg.solve(triangle[:-1, :-1], np.eye(len(kept)))
        apart = [_whitened(np.moveaxis(own, 0, -1), left) for own, left in zip(missed, roots, strict=True)]
        scores = [part[:, kept].T @ own for part, own in zip(parts, apart, strict=True)]
        covariance, known = _covariance(scores, root)
        level = max(1.0, cost / freedom)
        if np.all(
            np.abs(parameters - before)[kept] <= _SETTLED * np.sqrt(level) * np.linalg.norm(root, axis=1)
        ):
            periods = " + ".join(str(len(motion.periods)) for motion in motions)
            message = f"maximum likelihood from {periods} periods; mean squared error {cost / freedom:.3g} of the noise"
            return unknowns.estimate(parameters, level * covariance, known, cost, freedom, message, iteration)
    raise FlexcalError(
        "E-DYN-008", f"the noise estimate does not converge in {_ITERATIONS} iterations; use --estimator wls."
    )


def _require_memory(recorded: RecordedRows) -> None:
    samples = sum(experiment.samples for experiment in recorded.experiments)
    needed, there = _HELD * samples * recorded.observation.model.n, physical_memory()
    if there is not None and needed > there:
        raise FlexcalError(
            "E-DYN-009",
            f"maximum likelihood holds the motion of all logs in memory, {needed / 1e9:.1f} GB for {samples} samples, and this machine has "
            f"{there / 1e9:.1f} GB; give it fewer periods, or take --estimator wls.",
        )


def _mean_rows(observation: Observation, motion: RepeatedMotion, factor: int) -> np.ndarray:
    """Rows [W, Y] of the mean motion (2 K + 1, n, p + 1), averaged over the times of all periods, since friction depends on time and
    history.
    """
    memory: Memory = {}
    again = (replace(motion.mean, time=period.time) for period in motion.periods)
    return np.mean([_coefficients(observation, each, memory, factor) for each in again], axis=0)


def _coefficients(observation: Observation, motion: Motion, memory: Memory, factor: int) -> np.ndarray:
    """Fourier coefficients of [W, Y] for one period (2 K + 1, n, p + 1)."""
    systems = [_rows(system.T, factor) for system in observation.systems(motion, memory)]
    coefficients = np.zeros((len(systems[0]), observation.model.n, len(observation.names) + 1))
    for joint, (system, column_indices) in enumerate(zip(systems, observation.column_indices, strict=True)):
        coefficients[:, joint, column_indices] = system[:, :-1]
        coefficients[:, joint, -1] = system[:, -1]
    return coefficients


def _rows(values: np.ndarray, factor: int) -> np.ndarray:
    """Real Fourier coefficients (2 K + 1, …) of one period (N, …) up to half the rate that a decimation by `factor` leaves."""
    lines = min(len(values) // (2 * factor), (len(values) - 1) // 2) + 1
    return real_rows(np.fft.rfft(values, axis=0)[:lines] / len(values))


def _covariance(scores: list[np.ndarray], root: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance (k, k) of the parameters and its degrees of freedom, from the `scores` (k, P) of every experiment, period by period.

    `root` (k, k) has root · rootᵀ = (WᵀW)⁻¹ of the whitened rows W. Periods are few: standard deviations are moderated towards those of
    root · rootᵀ times a common factor, with the freedom that their ratios to these show (`moderated`), and correlations as by
    `mixed_covariance`. They are never below those of root · rootᵀ: weights from the same scatter make it too small.
    """
    nominal = root @ root.T
    apart = [own - own.mean(axis=1, keepdims=True) for own in scores]
    counts = [own.shape[1] for own in scores]
    middle = sum(own @ own.T / (count * (count - 1)) for own, count in zip(apart, counts, strict=True))
    scatter = nominal @ middle @ nominal
    freedom = float(sum(counts) - len(counts))
    ratios, known = moderated(np.diag(scatter) / np.diag(nominal), freedom)
    std = np.sqrt(np.maximum(1.0, ratios) * np.diag(nominal))
    return mixed_covariance(scatter, nominal, std, freedom), known


def _residuals(
    observation: Observation, motion: RepeatedMotion, parameters: np.ndarray, factor: int
) -> np.ndarray:
    """Residual τ − W χ of every period (P, 2 K + 1, n)."""
    memory: Memory = {}
    return np.array([_rows(_missed(observation, p, parameters, memory), factor) for p in motion.smooth])


def _scatter(residuals: np.ndarray) -> np.ndarray:
    """Covariance (2 K + 1, n, n) of the mean over the periods (P, 2 K + 1, n), smooth over the lines."""
    count = len(residuals)
    apart = residuals - residuals.mean(axis=0)
    above = np.arange(1, apart.shape[1] // 2 + 1)
    lines = np.concatenate([[0], above, above])
    shape = _shapes(np.sum(apart**2, axis=0), lines)
    scaled = apart / shape
    products = np.einsum("tli,tlj->lij", scaled, scaled)
    near = (np.abs(lines[:, None] - lines) <= _REACH).astype(float)
    pooled = np.einsum("lk,kij->lij", near, products) / near.sum(axis=1)[:, None, None]
    return pooled * shape[:, :, None] * shape[:, None, :] / (count * (count - 1))


def _shapes(squares: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Amplitude (2 K + 1, n) of the first-order noise that best fits the lowest lines of `squares` (2 K + 1, n).

    Noise with a memory has far more power in the lowest lines than in those that they are pooled with.
    """
    lowest = lines <= 2 * _REACH
    tried = np.array([1.0 / (1.0 + (lines / corner) ** 2) for corner in _CORNERS])
    floor = np.finfo(float).tiny
    levels = np.log(
        np.maximum(np.array([(squares / own[:, None])[lowest].mean(axis=0) for own in tried]), floor)
    )
    cost = levels * np.sum(lowest) + np.log(tried)[:, lowest].sum(axis=1)[:, None]
    return np.sqrt(tried[np.argmin(cost, axis=0)].T)


def _missed(observation: Observation, motion: Motion, parameters: np.ndarray, memory: Memory) -> np.ndarray:
    """Residual τ − W χ (N, n) of one period."""
    residuals = []
    for start in range(0, len(motion), _BLOCK):
        part = motion.part(start, min(start + _BLOCK, len(motion)))
        systems = observation.systems(part, memory)
        residuals.append(
            [s[-1] - parameters[m] @ s[:-1] for s, m in zip(systems, observation.column_indices, strict=True)]
        )
    return np.concatenate(residuals, axis=1).T


def _root(covariance: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Lower Cholesky factors (2 K + 1, n, n), bounded below by a share of the torques, the last column of `rows`."""
    floor = (_SMALLEST * np.sqrt(np.mean(rows[:, :, -1] ** 2, axis=0))) ** 2
    return np.linalg.cholesky(covariance + np.diag(np.where(floor > 0, floor, 1.0)))


def _whitened(rows: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Whitened equations (n (2 K + 1), ·) with independent errors of unit variance."""
    return np.linalg.solve(root, rows).reshape(-1, rows.shape[2])
