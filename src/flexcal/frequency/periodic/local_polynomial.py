"""Robust local polynomial method: frequency responses from few experiments, or from records with transients.

Pintelon and Schoukens 2012, ch. 7. A transient leaks smoothly over frequency, so near a line it is the polynomial through the bins
between the lines, which carry nothing else but noise: it is taken out of position and torque alike. What is left over a few lines and
all experiments, Y(k+d) = (Σ_m G_m d^m) U(k+d) + V(k+d), gives G_0, the response, by least squares; the scatter about it is noise,
distortion, and what a parabola misses of a resonance.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic.covariance import kronecker, output_noise
from flexcal.frequency.periodic.line_spectra import has_reference, kept_samples
from flexcal.frequency.periodic.local_windows import ORDER, LocalWindows
from flexcal.frequency.periodic.pose_records import PoseRecords, by_pose
from flexcal.frequency.periodic.response import SMALLEST_FREEDOM, FrequencyResponse, axis_names, sensed
from flexcal.frequency.periodic.steady_state import column_factor

LEAST_LINES, MOST_LINES = 3, 7
"""Least and largest number of lines in a window: enough for a parabola, few enough to resolve a resonance."""
TRANSIENT_BINS = 12
"""Number of bins between the lines from which a transient is estimated."""
_RANK_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class LocalPolynomialFit:
    """`response` (L, n_y, n_u); the covariance of its vec (column-major) is `gain` (L, n_u, n_u) ⊗ `scatter` (L, n_y, n_y).

    `scatter` is that of the outputs about the fit, with `degrees_of_freedom`.
    """

    response: np.ndarray
    gain: np.ndarray
    scatter: np.ndarray
    degrees_of_freedom: int


def local_polynomial(inputs: np.ndarray, outputs: np.ndarray, count: int) -> LocalPolynomialFit:
    """Local polynomial fit to spectra of E experiments at L lines, U (E, L, n_u) and Y (E, L, n_y), from `count` lines around each.

    Raises `FlexcalError` where these are too few, or where the excitation does not tell the inputs apart.
    """
    experiments, lines, n_u = inputs.shape
    unknowns = (ORDER + 1) * n_u
    freedom = experiments * count - unknowns
    if freedom < outputs.shape[-1] or count > lines:
        raise FlexcalError(
            "E-FRF-014",
            f"a window of {count} of {lines} lines in {experiments} experiments cannot determine {unknowns} unknowns and a "
            "covariance; measure more lines or experiments.",
        )
    at = np.arange(lines)
    windows = LocalWindows.of(at, lines, count)
    u = windows.seen(inputs)
    y = windows.seen(outputs).reshape(lines, -1, outputs.shape[-1])
    scale = np.sqrt((np.abs(u) ** 2).mean((1, 2)))[:, None, None, :]
    if not (scale > 0.0).all():
        raise FlexcalError(
            "E-FRF-015",
            "an input of the local polynomial method carries no power at some line; excite every axis.",
        )
    q, r = np.linalg.qr(windows.regressors(u / scale).reshape(lines, experiments * count, unknowns))
    diagonal = np.abs(np.diagonal(r, axis1=-2, axis2=-1))
    if (diagonal.min(-1) < _RANK_TOLERANCE * diagonal.max(-1)).any():
        raise FlexcalError(
            "E-FRF-016",
            "the excitation near some line does not separate the inputs of the local polynomial method; measure more experiments.",
        )
    projected = np.swapaxes(q, -1, -2).conj() @ y
    inverse = np.linalg.solve(r, np.broadcast_to(np.eye(unknowns), r.shape))[
        :, :n_u
    ]  # the rows that belong to G_0
    response = np.swapaxes(inverse @ projected / scale[:, 0, 0, :, None], -1, -2)
    gain = inverse @ np.swapaxes(inverse, -1, -2).conj() / (scale[:, 0, 0, :, None] * scale[:, 0, 0, None, :])
    residual = y - q @ projected
    return LocalPolynomialFit(
        response, gain, np.swapaxes(residual, -1, -2) @ residual.conj() / freedom, freedom
    )


def without_transient(
    columns: np.ndarray, lines: np.ndarray, quiet: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Spectra (E, K, c) at the bins `lines` (L,) less the transient, (E, L, c), and the covariance (L, c, c) of the remaining noise.

    The transient is a polynomial through the nearest of the bins `quiet` (B,), which carry no periodic signal. Raises `FlexcalError`
    where these are too few.
    """
    if quiet.size < TRANSIENT_BINS:
        raise FlexcalError(
            "E-FRF-017",
            f"{quiet.size} bins between the lines are too few to estimate a transient; record more periods or lines.",
        )
    first = np.clip(np.searchsorted(quiet, lines) - TRANSIENT_BINS // 2, 0, quiet.size - TRANSIENT_BINS)
    window = quiet[first[:, None] + np.arange(TRANSIENT_BINS)]  # (L, W)
    distance = (window - lines[:, None]) / TRANSIENT_BINS
    powers = distance[:, :, None] ** np.arange(ORDER + 1)
    q, r = np.linalg.qr(powers)
    seen = np.moveaxis(columns[:, window], 0, 1)  # (L, E, W, c)
    projected = np.swapaxes(q, 1, 2)[:, None] @ seen
    centre = np.linalg.solve(r, np.broadcast_to(np.eye(ORDER + 1), r.shape))[
        :, :1
    ]  # the row of the value at the line
    corrected = columns[:, lines] - np.moveaxis((centre[:, None] @ projected)[:, :, 0], 0, 1)
    residual = (seen - q[:, None] @ projected).reshape(len(lines), -1, columns.shape[2])
    noise = np.swapaxes(residual, 1, 2) @ residual.conj() / (len(columns) * (TRANSIENT_BINS - ORDER - 1))
    return corrected, noise * (1.0 + (centre**2).sum((1, 2)))[:, None, None]


def local_polynomial_responses(
    plan: MultisinePlan, recordings: Iterable[Recording], *, joint_names: Sequence[str] | None = None
) -> Iterator[FrequencyResponse]:
    """The frequency response of every pose by the local polynomial method, each yielded when its recordings are complete.

    Nothing is dropped: the settle periods take part, and one realisation is enough. With both signs they are subtracted, which
    takes the reference motion out; without, there must be none. A window holds as many lines as give the covariance 20 degrees
    of freedom, from 3 to 7. Raises `FlexcalError` where a recording is missing, double, too short or does not fit.
    """
    if has_reference(plan) and not plan.signs:
        raise FlexcalError(
            "E-FRF-018",
            "the local polynomial method cannot separate the reference motion from the response; measure both signs, or without it.",
        )
    names = axis_names(plan, joint_names)
    for records in by_pose(plan, recordings, keep_whole):
        yield _response(records, names)


def keep_whole(plan: MultisinePlan, recording: Recording) -> tuple[np.ndarray, ...]:
    """Mean position, and the spectrum (K, m + n) of position, sensors and torque over the whole record, at all bins from first to last
    line.
    """
    rows, axes = slice(0, kept_samples(plan, recording).stop), np.asarray(plan.joints)
    position = recording.q[rows]
    mean, readings = position.mean(0), recording.sensor_readings[rows]
    signal = np.hstack(
        [position[:, axes] - mean[axes], readings - readings.mean(0), recording.torque[rows][:, axes]]
    )
    band = np.asarray(plan.lines) * plan.periods
    return mean, np.fft.rfft(signal, axis=0)[band[0] : band[-1] + 1] * (2.0 / len(signal))


def _response(records: PoseRecords, names: tuple[str, ...]) -> FrequencyResponse:
    plan, n = records.plan, len(records.plan.joints)
    m = n + len(records.sensors)
    lines = np.asarray(plan.lines) * plan.periods
    columns = records.difference(1).reshape(-1, lines[-1] - lines[0] + 1, m + n)
    columns, noise = without_transient(columns, lines - lines[0], _quiet_bins(plan) - lines[0])
    factor = column_factor(records, np.asarray(plan.lines))
    columns = columns * factor
    noise = noise * factor[:, :, None] * factor[:, None, :].conj()
    needed = -(-(SMALLEST_FREEDOM + (ORDER + 1) * n) // len(columns))
    fit = local_polynomial(
        columns[:, :, m:], columns[:, :, :m], int(np.clip(needed + 1 - needed % 2, LEAST_LINES, MOST_LINES))
    )
    return FrequencyResponse(
        frequencies_hz=plan.frequencies_hz,
        **sensed(records.sensors, n, fit.response, kronecker(fit.gain, fit.scatter)),
        noise_covariance=kronecker(fit.gain, output_noise(fit.response, noise)[:, :n, :n]),
        degrees_of_freedom=fit.degrees_of_freedom,
        realisations=fit.response[None, :, :n],
        joints=names,
        q_mean=records.q_mean,
        payload=plan.payload,
        pose=records.pose,
        sample_time=records.time_step,
        average="local_polynomial",
    )


def _quiet_bins(plan: MultisinePlan) -> np.ndarray:
    """Bins of a record of P periods, from first to last line, without periodic components: distortion lies at multiples of f0.

    A reference at (m + 1/2) f0 reaches the half-integers too. One period has no bins between; there the even lines are taken.
    """
    lines, periods = np.asarray(plan.lines) * plan.periods, plan.periods
    bins = np.arange(lines[0], lines[-1] + 1)
    if periods == 1:
        return bins[bins % 2 == 0]
    between = bins[bins % periods != 0]
    return between[2 * between % periods != 0] if has_reference(plan) and periods > 2 else between
