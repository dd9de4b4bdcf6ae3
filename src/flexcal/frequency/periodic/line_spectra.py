"""Spectra of recordings: phasors of motor position and torque at chosen lines, and noise bins."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.data.plans import MultisinePlan, TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic.multisine import samples_per_period


@dataclass(frozen=True, eq=False)
class ExperimentSpectra:
    """Spectra of one pose that the averages need, in phasors (cosine amplitudes); E experiments, n excited axes.

    `outputs` (R, L, m, E), accelerations of the axes in rad/s² and the readings of m - n sensors, and `torque` (R, L, n, E)
    N m are measured, hold corrected and averaged over periods; `excitation` (R, L, n, E) N m is what the plan asked for;
    `noise` (L, m + n, m + n) is the covariance of one measured column [outputs; torque].
    """

    outputs: np.ndarray
    torque: np.ndarray
    excitation: np.ndarray
    noise: np.ndarray


def kept_samples(plan: MultisinePlan, recording: Recording) -> slice:
    """Range of samples of a recording from the end of the settle periods to the last whole period of the plan.

    Raises `FlexcalError` that names the recording where it is too short, or its sample time does not fit the plan.
    """
    step = recording.time_step
    if plan.torque == "held" and step * plan.rate_hz > 1.0 + 1e-6:
        raise FlexcalError(
            "E-FRF-009",
            f"{recording.name}: the log has a step of {step:g} s, longer than the {1.0 / plan.rate_hz:g} s for which the "
            "torque is held; log at the control rate.",
        )
    try:
        samples = samples_per_period(plan.base_frequency_hz, step)
    except FlexcalError as problem:
        raise FlexcalError(problem.code, f"{recording.name}: {problem}") from problem
    needed = plan.periods * samples
    if len(recording) < needed:
        raise FlexcalError(
            "E-FRF-010",
            f"{recording.name}: the log has {len(recording)} samples, fewer than the {needed} of {plan.periods} periods; "
            "record the whole experiment.",
        )
    return slice(plan.settle_periods * samples, needed)


def spectrum(signal: np.ndarray, periods: int, lines: np.ndarray) -> np.ndarray:
    """Phasors (L, …) of a signal (samples, …) over a whole number of periods, at `lines` > 0 in multiples of f0.

    Whole lines: the periods are averaged first, which gives the same numbers from a transform `periods` times shorter; where all are
    odd, as those of a multisine, from one of a quarter period.
    Lines that are multiples of 1 / periods (so half-integers for two): the transform of the whole stretch.
    """
    lines = np.asarray(lines)
    samples = signal.shape[0]
    if samples % periods:
        raise FlexcalError(
            "E-FRF-011", f"{samples} samples do not divide into {periods} periods; cut whole periods."
        )
    if 2 * periods * lines.max(initial=0) >= samples:
        raise FlexcalError(
            "E-FRF-041",
            f"The line {lines.max():g} needs more than the {samples // periods} samples of a period; log at a higher rate, or plan a "
            "lower band.",
        )
    if np.issubdtype(lines.dtype, np.integer):
        if samples % (4 * periods) == 0 and (lines % 2 == 1).all():
            return _odd_bins(signal, periods, lines)
        signal = signal.reshape(periods, samples // periods, *signal.shape[1:]).mean(0)
        bins = lines
    else:
        bins = np.rint(lines * periods).astype(int)
        if not np.allclose(bins, lines * periods, atol=1e-6):
            raise FlexcalError(
                "E-FRF-012",
                f"A line is not a multiple of 1/{periods} of the base frequency; keep more periods.",
            )
    columns = np.ascontiguousarray(signal.reshape(signal.shape[0], -1).T)
    columns -= columns.mean(1, keepdims=True)
    phasors = np.fft.rfft(columns, axis=1)[:, bins].T * (2.0 / signal.shape[0])
    return phasors.reshape(bins.size, *signal.shape[1:])


def _odd_bins(signal: np.ndarray, periods: int, bins: np.ndarray) -> np.ndarray:
    """`spectrum` at odd bins of the mean of the periods, x_n with N a multiple of four.

    X_{4m+1} = Σ_{n<N/4} (d_n - j d_{n+N/4}) exp(-j2πn/N) exp(-j2πnm/(N/4)) with d_n = x_n - x_{n+N/2}, X_{4m+3} the conjugate of
    X_{N-4m-3}: a transform of a quarter of the length.
    """
    quarter = len(signal) // (4 * periods)
    weights, turn = _folding(periods, quarter)
    folded = (weights @ signal.reshape(4 * periods, -1)).reshape(2, quarter, -1)
    turned = np.empty((folded.shape[2], quarter), complex)
    turned.real, turned.imag = folded[0].T, folded[1].T
    turned *= turn
    first = bins % 4 == 1
    phasors = np.fft.fft(turned, axis=1, out=turned).take(
        np.where(first, bins // 4, quarter - 1 - bins // 4), axis=1
    )
    phasors.imag *= np.where(first, 1.0, -1.0)
    return phasors.T.reshape(bins.size, *signal.shape[1:])


@lru_cache(maxsize=1)
def _folding(periods: int, quarter: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights (2, 4 periods) of the quarter periods in the real and imaginary part of what is transformed, and exp(-jπn/2N), n < N."""
    weights = np.tile([[1.0, 0.0, -1.0, 0.0], [0.0, -1.0, 0.0, 1.0]], periods) / (2 * quarter * periods)
    return weights, np.exp(-0.5j * np.pi / quarter * np.arange(quarter))


def noise_in_half_sum(plan: MultisinePlan) -> bool:
    """Whether the noise is estimated from (plus + minus)/2 at the excited lines themselves; see `noise_lines`."""
    return plan.signs and not (has_reference(plan) and _is_whole(_reference_ratio(plan)))


def noise_lines(plan: MultisinePlan) -> np.ndarray:
    """Bins (multiples of f0) for the noise covariance, which hold noise and least of anything else.

    Both signs, reference at (m + 1/2) f0 or none: the half sum (plus + minus)/2 at the excited odd lines. The linear
    response and all terms odd in the excitation cancel there; what is even in it falls on even lines or, times the
    reference, on half-integers; only even harmonics of the reference reach odd lines and are left out. Its noise is
    that of the half difference, at the very same lines. The half-integer bins of the half difference would be free
    of Coulomb friction too (its sidebands keep to whole multiples of f0, the first ones, at ± 2 f_ref, to even
    multiples) but not of the change of inertia and gravity along the reference, whose sidebands at ± f_ref land there.

    Reference on the grid of f0, or one sign only: the bins between the lines, at multiples of 1/P over P kept periods
    that are no whole multiples of f0 (the half-integers for P = 2) and no multiples of f_ref. With the reference on
    the grid all distortion is periodic in one period and none of it lands there. For P = 1 the even lines are left,
    where even distortion and friction sidebands count as noise.

    Raises `FlexcalError` where the harmonics of the reference leave no such bin.
    """
    if noise_in_half_sum(plan):
        candidates = np.asarray(plan.lines)
    else:
        kept = plan.periods - plan.settle_periods
        low, high = int(np.min(plan.lines)), int(np.max(plan.lines))
        if kept == 1:
            candidates = np.arange(low + low % 2, high + 1, 2)
        else:
            bins = np.arange(low * kept, high * kept + 1)
            candidates = bins[bins % kept != 0] / kept
    if not has_reference(plan):
        return candidates
    clear = candidates[~_is_whole(candidates / _reference_ratio(plan))]
    if not clear.size:
        raise FlexcalError(
            "E-FRF-013",
            f"the harmonics of the reference motion ({plan.reference_frequency_hz:g} Hz) fall on every line of this plan, so none shows "
            "the noise; choose reference_frequency_hz (m + 1/2) times the base frequency "
            f"({plan.base_frequency_hz:g} Hz), with m = 8 for example.",
        )
    return clear


def torque_hold(plan: MultisinePlan | TrajectoryPlan, omega: np.ndarray, time_step: float) -> np.ndarray:
    """Hold correction `hold_factor` of the torque that a plan declares."""
    return hold_factor(plan.torque, omega, time_step)


def hold_factor(kind: str, omega: np.ndarray, time_step: float) -> np.ndarray:
    """Factor (L,) from the spectrum of logged torque samples to that of the applied torque; T = time_step.

    "held": the sample acts until the next one, sinc(ωT/2) exp(-jωT/2), exact for a staircase. "instantaneous": 1, the
    log is the torque at the sampling instant. "mean": the log is the mean over the step that begins at the sample, of
    a torque that varies smoothly within it, so exp(-jωT/2) / sinc(ωT/2).
    """
    half = 0.5 * np.asarray(omega) * time_step
    if kind == "instantaneous":
        return np.ones(half.shape, complex)
    if kind == "mean":
        return np.exp(-1j * half) / np.sinc(half / np.pi)
    return np.sinc(half / np.pi) * np.exp(-1j * half)


def has_reference(plan: MultisinePlan) -> bool:
    """Whether the plan has a reference motion under the excitation."""
    return plan.reference_amplitude != 0.0 and plan.reference_frequency_hz != 0.0


def _reference_ratio(plan: MultisinePlan) -> float:
    return plan.reference_frequency_hz / plan.base_frequency_hz


def _is_whole(ratio: np.ndarray | float) -> np.ndarray:
    return np.abs(ratio - np.rint(ratio)) < 1e-6
