"""Local polynomial method: a frequency response from few experiments, or from records that never reach a steady state.

Pintelon and Schoukens 2012, ch. 7: around every line, Y(k+d) = (Σ_m G_m d^m) U(k+d) + Σ_m T_m d^m + V(k+d) is fitted by
least squares, with the plant G shared by all experiments and a transient (leakage) term T for each. G_0 is the response.
"""

from collections.abc import Iterable

import numpy as np

from flexcal.data import MultisinePlan, Recording
from flexcal.errors import FlexcalError
from flexcal.frequency import covariance as cov
from flexcal.frequency.spectrum import torque_hold

ORDER = 2
_RANK_TOLERANCE = 1e-10


def local_polynomial(
    inputs: np.ndarray, outputs: np.ndarray, bins: np.ndarray, half_width: int, order: int = ORDER
) -> tuple[np.ndarray, np.ndarray, int]:
    """G and its covariance from the full-record spectra of E experiments: U (E, K, n_u), Y (E, K, n_y) at bins 0…K-1.

    `bins` (L,) are where G is wanted, `half_width` the bins on either side that take part. Returns G (L, n_y, n_u), the
    covariance (L, n_y n_u, n_y n_u) of vec G (column-major; from the residuals: noise and distortion together) and the
    residual degrees of freedom of a window. Raises `FlexcalError` where a window has too few bins, or where the
    excitation in it does not tell the inputs apart.
    """
    experiments, count, n_u = inputs.shape
    n_y = outputs.shape[-1]
    width = 2 * half_width + 1
    unknowns = (order + 1) * (n_u + experiments)
    freedom = experiments * width - unknowns
    if freedom < n_y or width > count:
        raise FlexcalError(
            f"A window of {width} bins and {experiments} experiments cannot determine {unknowns} unknowns and a "
            f"covariance; the record has {count} bins: widen the window or record longer."
        )
    start = np.clip(np.asarray(bins) - half_width, 0, count - width)
    window = start[:, None] + np.arange(width)
    distance = (window - np.asarray(bins)[:, None]) / half_width
    powers = distance[:, :, None] ** np.arange(order + 1)  # (L, W, M)

    u = np.moveaxis(inputs[:, window], 0, 1)  # (L, E, W, n_u)
    y = np.moveaxis(outputs[:, window], 0, 1).reshape(window.shape[0], -1, n_y)
    scale = np.sqrt((np.abs(u) ** 2).mean((1, 2)))[:, None, None, :]
    if not (scale > 0.0).all():
        raise FlexcalError(
            "An input carries no power in a window of the local polynomial method; widen the window."
        )
    plant = powers[:, None, :, :, None] * (u / scale)[:, :, :, None, :]
    transient = powers[:, None, :, None, :] * np.eye(experiments)[None, :, None, :, None]
    shape = (window.shape[0], experiments * width, -1)
    transient = np.broadcast_to(transient, (window.shape[0], experiments, width, experiments, order + 1))
    regressors = np.concatenate([plant.reshape(shape), transient.reshape(shape)], -1)

    q, r = np.linalg.qr(regressors)
    diagonal = np.abs(np.diagonal(r, axis1=-2, axis2=-1))
    if (diagonal.min(-1) < _RANK_TOLERANCE * diagonal.max(-1)).any():
        raise FlexcalError(
            "The excitation in a window of the local polynomial method does not tell the inputs apart; widen the window "
            "or measure more experiments."
        )
    projected = np.swapaxes(q, -1, -2).conj() @ y
    selector = np.broadcast_to(np.eye(r.shape[-1]), r.shape)
    inverse = np.linalg.solve(r, selector)[:, :n_u]  # the rows of R⁻¹ that belong to G_0
    response = np.swapaxes(inverse @ projected / scale[:, 0, 0, :, None], -1, -2)
    residual = y - q @ projected
    noise = np.swapaxes(residual, -1, -2) @ residual.conj() / freedom
    gain = inverse @ np.swapaxes(inverse, -1, -2).conj()
    gain = gain / (scale[:, 0, 0, :, None] * scale[:, 0, 0, None, :])
    return response, cov.kronecker(gain, noise), freedom


def local_polynomial_response(
    plan: MultisinePlan, recordings: Iterable[Recording], half_width: int, order: int = ORDER
) -> tuple[np.ndarray, np.ndarray, int]:
    """G (L, n, n) in rad/s² per N m at the lines of the plan, with covariance and residual degrees of freedom.

    `recordings` are all of one pose and of equal length: one, or several experiments, of any realisation, with or
    without a steady state; nothing is dropped. They enter as they are: subtract a reference motion first, or leave it
    out of the plan, and leave the sign of an experiment alone. The record must be a whole number of periods, so the lines
    are bins of it; `half_width` counts those bins, P of them from line to line over P periods.
    """
    positions, torques, steps = [], [], set()
    axes = np.asarray(plan.joints)
    for recording in recordings:
        positions.append(recording.q[:, axes] - recording.q[:, axes].mean(0))
        torques.append(recording.torque[:, axes])
        steps.add(recording.time_step)
    if len(steps) != 1 or len({position.shape for position in positions}) != 1:
        raise FlexcalError("The local polynomial method needs recordings of one length and one sample time.")
    step, samples = steps.pop(), positions[0].shape[0]
    bins = np.asarray(plan.lines) * plan.base_frequency_hz * step * samples
    if np.abs(bins - np.rint(bins)).max() > 1e-6 * samples:
        raise FlexcalError(
            "The recordings are not a whole number of periods long; cut them to whole periods."
        )
    bins = np.rint(bins).astype(int)
    top = min(bins.max() + half_width + 1, samples // 2)
    first = max(bins.min() - half_width, 1)
    omega = 2.0 * np.pi * np.arange(first, top) / (samples * step)
    hold = torque_hold(plan, omega, step)
    y = np.fft.rfft(np.stack(positions), axis=1)[:, first:top] * -(omega**2)[:, None]
    u = np.fft.rfft(np.stack(torques), axis=1)[:, first:top] * hold[:, None]
    return local_polynomial(u, y, bins - first, half_width, order)
