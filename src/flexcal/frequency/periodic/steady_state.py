"""Spectra of recordings in a periodic steady state: mean of periods, difference of signs, noise from empty bins."""

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording
from flexcal.frequency.periodic.covariance import column_noise
from flexcal.frequency.periodic.line_spectra import (
    ExperimentSpectra,
    kept_samples,
    noise_in_half_sum,
    noise_lines,
    spectrum,
    torque_hold,
)
from flexcal.frequency.periodic.multisine import multisine_spectra
from flexcal.frequency.periodic.pose_records import PoseRecords


def keep_periods(plan: MultisinePlan, recording: Recording) -> tuple[np.ndarray, ...]:
    """Mean position, and spectra (bins, m + n) of position, sensors and torque after the settle periods: at lines, detection lines,
    empty bins.

    The last only where the noise is not read from the half sum of both signs. Raises `FlexcalError` as `kept_samples` does.
    """
    rows, axes = kept_samples(plan, recording), np.asarray(plan.joints)
    position, torque, sensed = recording.q[rows], recording.torque[rows], recording.sensor_readings[rows]
    periods = plan.periods - plan.settle_periods

    def columns(lines: np.ndarray) -> np.ndarray:
        q, u = (spectrum(x, periods, lines)[:, axes] for x in (position, torque))
        return np.hstack([q, spectrum(sensed, periods, lines), u] if recording.sensors else [q, u])

    mean = np.full(len(position), 1.0 / len(position)) @ position
    whole = columns(np.concatenate([plan.lines, plan.detection_lines]))
    kept = (mean, *np.split(whole, [len(plan.lines)]))
    return kept if noise_in_half_sum(plan) else (*kept, columns(noise_lines(plan)))


def experiment_spectra(records: PoseRecords, pooled_lines: int) -> ExperimentSpectra:
    """Spectra of all realisations: signs subtracted, hold corrected, noise pooled over neighbouring bins."""
    plan = records.plan
    m = len(plan.joints) + len(records.sensors)
    lines, empty_lines = np.asarray(plan.lines), noise_lines(plan)
    columns = records.difference(1)
    half = noise_in_half_sum(plan)
    empty = records.half_sum(1)[:, :, np.isin(lines, empty_lines)] if half else records.difference(3)
    factor = column_factor(records, lines)
    columns = np.moveaxis(columns * factor, 1, -1)  # (R, L, m + n, E)
    empty = empty.transpose(2, 0, 1, 3).reshape(empty.shape[2], -1, columns.shape[2])
    noise = column_noise(empty, empty_lines, lines, pooled_lines)
    return ExperimentSpectra(
        outputs=columns[..., :m, :],
        torque=columns[..., m:, :],
        excitation=np.stack([multisine_spectra(plan, member) for member in range(plan.realisations)]),
        noise=noise * factor[:, :, None] * factor[:, None, :].conj(),
    )


def column_factor(records: PoseRecords, lines: np.ndarray) -> np.ndarray:
    """Factors (L, m + n) from phasors of position and logged torque to acceleration and applied torque; 1 for sensors."""
    n = len(records.plan.joints)
    omega = 2.0 * np.pi * records.plan.base_frequency_hz * lines
    hold = torque_hold(records.plan, omega, records.time_step)
    sensed = np.ones((len(lines), len(records.sensors)))
    return np.concatenate([np.repeat(-(omega**2)[:, None], n, 1), sensed, np.repeat(hold[:, None], n, 1)], 1)


def odd_distortion(records: PoseRecords, response: np.ndarray, noise: np.ndarray) -> np.ndarray | None:
    """Odd nonlinear distortion of each axis (n,), relative to its excited acceleration; None without detection lines.

    Nothing but distortion and noise is at the lines that the excitation leaves out: the root mean square there of Q̈ - G Γ, in which the
    controller's answer cancels, less what the `noise` (L, n, n) of that difference explains. `response` (L, n, n).
    """
    plan, n = records.plan, len(records.plan.joints)
    lines, left_out = np.asarray(plan.lines), np.asarray(plan.detection_lines)
    if not left_out.size:
        return None
    seen = records.difference(2) * column_factor(records, left_out)  # (R, E, K, m + n)
    between = np.array([[np.interp(left_out, lines, g) for g in row] for row in np.moveaxis(response, 0, -1)])
    error = seen[..., :n] - np.einsum("ijk,rekj->reki", between, seen[..., -n:])
    power = (np.abs(error) ** 2).mean((0, 1, 2))
    quiet = np.array([np.interp(left_out, lines, np.real(noise[:, i, i])).mean() for i in range(n)])
    excited = np.abs(records.difference(1)[..., :n] * column_factor(records, lines)[:, :n]) ** 2
    return np.sqrt(np.maximum(power - quiet, 0.0) / excited.mean((0, 1, 2)))
