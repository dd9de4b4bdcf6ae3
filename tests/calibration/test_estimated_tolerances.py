"""Intervals of parameters whose prior's sizes were estimated from the same readings, against drawn problems and a grid of sizes."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from flexcal.calibration.fit.estimated_tolerances import widening

READINGS, KINDS = 26, np.repeat([0, 1], 9)
NAMES = tuple(f"p{k}" for k in range(len(KINDS)))
NAMED = {name: "ab"[kind] for name, kind in zip(NAMES, KINDS, strict=True)}
USUAL, SPREAD = 0.1, np.log(2.0)


def drawn(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, parameters and readings of a problem whose sizes are drawn about 1 and the scatter about its usual size."""
    columns = rng.normal(size=(READINGS, len(KINDS)))
    sizes = np.exp(rng.normal(0, SPREAD, 2))
    truth = rng.normal(size=len(KINDS)) * sizes[KINDS]
    scatter = USUAL * np.exp(rng.normal(0, SPREAD))
    return columns, truth, columns @ truth + rng.normal(0, scatter, READINGS)


def deviance(x: np.ndarray, columns: np.ndarray, readings: np.ndarray) -> float:
    """Of the log sizes of both kinds and the log scatter, with their priors."""
    variances = np.exp(2 * x[:2])[KINDS]
    covariance = columns * variances @ columns.T + np.exp(2 * x[2]) * np.eye(len(columns))
    own = readings @ np.linalg.solve(covariance, readings) + np.linalg.slogdet(covariance)[1]
    far = (x[2] - np.log(USUAL)) / SPREAD
    return float(own + np.sum((x[:2] / SPREAD) ** 2) + 2 * np.log1p(far**2))


def estimated(
    x: np.ndarray, columns: np.ndarray, readings: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Estimate under these sizes, its covariance, the information of the readings, and the prior's covariance."""
    prior = np.diag(np.exp(2 * x[:2])[KINDS])
    information = columns.T @ columns / np.exp(2 * x[2])
    covariance = np.linalg.inv(information + np.linalg.inv(prior))
    return covariance @ columns.T @ readings / np.exp(2 * x[2]), covariance, information, prior


def most_probable(columns: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """Log sizes and log scatter of largest marginal likelihood."""
    start = np.array([0.0, 0.0, np.log(USUAL)])
    return minimize(deviance, start, (columns, readings), method="L-BFGS-B").x


def test_intervals_hold() -> None:
    """Of 150 problems: 95 % of the parameters are within theirs, which under known sizes would be too narrow."""
    rng = np.random.default_rng(11)
    wide, narrow = [], []
    for _ in range(150):
        columns, truth, readings = drawn(rng)
        mean, covariance, information, prior = estimated(most_probable(columns, readings), columns, readings)
        more = widening(information, prior, mean, NAMES, NAMED, READINGS)
        for all_, matrix in ((narrow, covariance), (wide, covariance + more)):
            all_.append(np.mean(np.abs(truth - mean) < 1.96 * np.sqrt(np.diag(matrix))))
    error = 1.96 * np.std(wide) / np.sqrt(len(wide))
    assert np.mean(narrow) < 0.93
    assert 0.93 - error < np.mean(wide) < 0.97 + error


def test_variances_are_those_of_all_sizes() -> None:
    """Integrated over a grid of sizes and scatter, weighted by their probability."""
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(6):
        columns, _, readings = drawn(rng)
        x = most_probable(columns, readings)
        mean, covariance, information, prior = estimated(x, columns, readings)
        steps = np.linspace(-2.4, 2.4, 17)
        points = [x + np.array([a, b, c]) for a in steps for b in steps for c in steps]
        lost = np.array([deviance(point, columns, readings) for point in points])
        weight = np.exp(-0.5 * (lost - lost.min()))
        weight /= weight.sum()
        every = [estimated(point, columns, readings)[:2] for point in points]
        centre = sum(w * m for w, (m, _) in zip(weight, every, strict=True))
        exact = sum(w * (np.diag(c) + (m - centre) ** 2) for w, (m, c) in zip(weight, every, strict=True))
        more = widening(information, prior, mean, NAMES, NAMED, READINGS)
        ratios.append((covariance + more).trace() / exact.sum())
        assert covariance.trace() < 0.97 * exact.sum()
    assert 0.8 < np.exp(np.mean(np.log(ratios))) < 1.25


def test_exact_readings_widen_nothing() -> None:
    """Many readings tell parameters and sizes; a parameter without a prior widens nothing either."""
    rng = np.random.default_rng(5)
    columns = rng.normal(size=(4000, len(KINDS))) / 1e-6
    prior = np.eye(len(KINDS))
    prior[0, 0] = np.inf
    information = columns.T @ columns
    shift = rng.normal(size=len(KINDS))
    more = widening(information, prior, shift, NAMES, NAMED, len(columns))
    assert np.all(np.diag(more) >= 0)
    assert np.trace(more) < 0.01 * np.trace(np.linalg.inv(information))
