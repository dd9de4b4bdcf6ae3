"""Lack-of-fit test of the fitted robot, and the covariance of its parameters under a misfit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.elasticity.identification.fit import ResponseFit
from flexcal.estimation import Misfit
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import MASS_AND_COM, RobotModel

BAND_LINES = 8
"""Number of neighbouring lines over which the residual is averaged."""

NOTABLE, SEVERE = 2.0, 5.0
"""Mean square of the whitened residual over a band, 1 if noise and model error explain it, from which a misfit is reported, and from
which the springs are unreliable.
"""

SEVERE_CHI2 = 2.0
"""Reduced χ² of all lines from which the springs are unreliable."""

DOUBTFUL_STIFFNESS = 0.1
"""Least relative 1σ of a stiffness under a misfit: slipping drives differ so much between small motion and load."""
DOUBTFUL_HARDENING = 0.03
"""Least 1σ of a hardening under a misfit."""

FAR = 3.0
"""Ratio of a stiffness to its start from which, with a poor fit, it probably belongs to a wrong mode."""


CERTAIN = 1e-3
"""Significance level of the shift of masses and centres of mass."""


def inertial_shift(fit: ResponseFit) -> float:
    """Shift of masses and centres of mass, root mean square in prior standard deviations; 0 if not significant.

    Where the model is right the squared distance, in the metric of the prior covariance, is at most χ² distributed with as many degrees of
    freedom as there are of them. A larger one is a conflict of prior and data (Evans & Moshonov 2006).
    """
    from scipy.special import chdtri

    parameters = fit.estimate.parameters
    own = [k for k, name in enumerate(parameters.names) if name.rpartition(".")[2] in MASS_AND_COM]
    if not own:
        return 0.0
    assert fit.problem.prior_covariance is not None
    known = fit.problem.prior_covariance[np.ix_(own, own)]
    std = np.sqrt(np.diag(known))
    off = (parameters.coordinates() - parameters.prior_mean())[own] / std
    square = float(off @ np.linalg.pinv(known / std / std[:, None], hermitian=True) @ off)
    return float(np.sqrt(square / len(own))) if square > chdtri(len(own), CERTAIN) else 0.0


def find_misfit(fit: ResponseFit, responses: Sequence[FrequencyResponse]) -> Misfit | None:
    """Frequency band in which the residual of `fit` exceeds noise and model error; None without a misfit."""
    powers = _line_powers(fit)
    smooth = [_band_means(power) for power in powers]
    worst = int(np.argmax([means.max() for means in smooth]))
    means, response = smooth[worst], responses[worst]
    at = int(np.argmax(means))
    peak = float(means[at])
    estimate = fit.estimate
    if peak < NOTABLE and not estimate.unexplained:
        return None
    first, last = _around(means, at)
    band = slice(first, min(last + BAND_LINES, len(powers[worst])))
    error = np.abs(response.stacked - fit.predicted()[worst])[band] / response.stacked_std[band]
    outputs = (*response.joints, *(f"sensor {name}" for name in response.sensors))
    axis = outputs[int(np.argmax(np.mean(error**2, axis=(0, 2))))]
    far = implausible_springs(fit)
    return Misfit(
        reduced_chi2=float(estimate.reduced_chi2),
        peak=peak,
        pose=response.pose + 1,
        low_hz=float(response.frequencies_hz[band][0]),
        high_hz=float(response.frequencies_hz[band][-1]),
        axis=axis,
        far=far,
        inertials=inertial_shift(fit),
        severe=peak > SEVERE or estimate.reduced_chi2 > SEVERE_CHI2 or bool(far),
    )


def implausible_springs(fit: ResponseFit) -> tuple[str, ...]:
    """Names of stiffnesses more than a factor of `FAR`, by two standard deviations, from the start of the fit."""
    robot, stds = fit.residual.model.robot, np.sqrt(np.diag(fit.estimate.covariance))
    return tuple(
        name
        for (name, value), std in zip(fit.estimate.values.items(), stds, strict=True)
        if name.endswith(".stiffness") and _moved(robot, name, value) > np.log(FAR) + 2 * std
    )


def _moved(robot: RobotModel, name: str, value: float) -> float:
    """Change of the logarithm of a stiffness from robot.yaml's; 0 if it is not declared."""
    if robot.joint_index(name.split(".")[0]) in robot.springs.braked:
        return 0.0
    return abs(float(np.log(value / robot.value(name))))


def misfit_std(fit: ResponseFit, misfit: Misfit) -> np.ndarray:
    """Standard deviations (p,), in estimation coordinates, consistent with the size of a misfit.

    The sandwich over clusters of one octave of one pose, in which errors of the model are coherent, and no stiffness better known than to
    `DOUBTFUL_STIFFNESS`, no hardening than to `DOUBTFUL_HARDENING`. Where the misfit is severe, a stiffness is known no better than
    robot.yaml's, nor than its distance from that.
    """
    residual, jacobian = fit.problem.linearise(fit.x)
    posterior = fit.estimate.covariance
    clusters = octaves_of(fit)
    scores = np.stack([np.bincount(clusters, weights=residual * column) for column in jacobian.T], axis=1)
    std = np.sqrt(np.diag(posterior @ (scores.T @ scores) @ posterior))
    robot = fit.residual.model.robot
    for number, item in enumerate(fit.estimate.parameters):
        if item.name.endswith(".hardening"):
            std[number] = max(std[number], DOUBTFUL_HARDENING)
        if item.name.endswith(".stiffness"):
            std[number] = max(std[number], DOUBTFUL_STIFFNESS)
            if misfit.severe:
                std[number] = max(std[number], robot.prior.stiffness, _moved(robot, item.name, item.value))
    return std


def _line_powers(fit: ResponseFit) -> list[np.ndarray]:
    """Mean square (L,) of the whitened residual at every line of every pose."""
    residual = fit.problem.linearise(fit.x)[0]
    powers, start = [], 0
    for pose in fit.residual.poses:
        rows = 2 * pose.measured.size
        powers.append(np.mean(residual[start : start + rows].reshape(len(pose.measured), -1) ** 2, axis=1))
        start += rows
    return powers


def _band_means(power: np.ndarray) -> np.ndarray:
    """Moving mean over `BAND_LINES` lines, indexed by the first of them."""
    width = min(BAND_LINES, len(power))
    return np.convolve(power, np.full(width, 1 / width), "valid")


def _around(means: np.ndarray, at: int) -> tuple[int, int]:
    """First and last index around `at` with values above half of that there."""
    low = means < 0.5 * means[at]
    before, after = np.flatnonzero(low[:at]), np.flatnonzero(low[at:])
    return (int(before[-1]) + 1 if len(before) else 0), (
        at + int(after[0]) - 1 if len(after) else len(means) - 1
    )


def octaves_of(fit: ResponseFit) -> np.ndarray:
    """Cluster number (m,) of every row: one octave of one pose, in which errors of the model are coherent."""
    labels, first = [], 0
    for pose, at in zip(fit.residual.poses, fit.residual.model.poses, strict=True):
        octave = np.floor(np.log2(at.frequencies_hz / at.frequencies_hz[0])).astype(int)
        labels.append(first + np.repeat(octave, 2 * pose.measured[0].size))
        first += int(octave[-1]) + 1
    return np.concatenate(labels)
