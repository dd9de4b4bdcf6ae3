"""Odd random-phase multisines, orthogonal over the experiments of one realisation, and the slow reference under them.

Neubauer et al. 2015, eqs. (22)-(25); orthogonality after Dobrowiecki and Schoukens 2007. Phasors are cosine amplitudes:
a line of phasor X is |X| cos(2π k f0 t + arg X) in the time domain.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.errors import FlexcalError

_PEAK_SAMPLES_PER_LINE = 8  # time grid of the crest factor: samples per period of the highest line


def orthogonal_matrix(n_u: int) -> np.ndarray:
    """Unitary matrix T (n_u, n_u) of eq. (24), T_pq = n_u^(-1/2) exp(j 2π (p-1)(q-1) / n_u), for any n_u ≥ 1."""
    if n_u < 1:
        raise FlexcalError("E-FRF-019", f"a multisine needs at least one excited axis, not {n_u}.")
    index = np.arange(n_u)
    return np.exp(2j * np.pi / n_u * ((index[:, None] * index) % n_u)) / np.sqrt(n_u)


def odd_lines(base_frequency_hz: float, low_hz: float, high_hz: float) -> np.ndarray:
    """Odd multiples (integers) of the base frequency in [low_hz, high_hz]: the lines of eq. (22)."""
    first = int(np.ceil(low_hz / base_frequency_hz - 1e-9))
    last = int(np.floor(high_hz / base_frequency_hz + 1e-9))
    lines = np.arange(max(first, 1), last + 1)
    lines = lines[lines % 2 == 1]
    if not lines.size:
        raise FlexcalError(
            "E-FRF-020",
            f"no odd multiple of {base_frequency_hz} Hz lies in {low_hz}-{high_hz} Hz; widen the band.",
        )
    return lines


def leave_out_detection_lines(plan: MultisinePlan, group: int = 4) -> MultisinePlan:
    """Plan without one random line of every `group` successive ones, the others amplified to the same power.

    What these detection lines show above the noise is the odd nonlinear distortion (Pintelon & Schoukens 2012, §4.3); the same lines are
    left out in all experiments, so the excited ones stay orthogonal. Which ones is a function of the plan's seed.
    """
    lines = np.asarray(plan.lines)
    rng = np.random.default_rng([plan.seed, lines.size])
    starts = np.arange(0, lines.size - group + 1, group)
    left_out = starts + rng.integers(group, size=starts.size)
    kept = np.delete(plan.amplitude, left_out, axis=1)
    scale = np.sqrt((plan.amplitude**2).sum(1) / (kept**2).sum(1))
    return replace(
        plan,
        lines=np.delete(lines, left_out),
        detection_lines=lines[left_out],
        amplitude=kept * scale[:, None],
    )


def half_integer_frequency(base_frequency_hz: float, near_hz: float) -> float:
    """Reference frequency (m + 1/2) f0 nearest to `near_hz`.

    Coulomb friction under the moving reference modulates at even multiples of the reference frequency; with this choice
    the first sidebands (±2 f_ref, odd multiples of f0) of the odd lines fall on even, unexcited lines.
    """
    order = max(round(near_hz / base_frequency_hz - 0.5), 0)
    return (order + 0.5) * base_frequency_hz


def random_phases(plan: MultisinePlan, realisation: int) -> np.ndarray:
    """Uniform random phases (n_u, L) in rad of one realisation; a function of (plan.seed, realisation) alone."""
    sequence = np.random.SeedSequence(entropy=plan.seed, spawn_key=(int(realisation),))
    return np.random.default_rng(sequence).uniform(0.0, 2.0 * np.pi, np.shape(plan.amplitude))


@lru_cache(maxsize=64)
def phases(plan: MultisinePlan, realisation: int) -> np.ndarray:
    """Phases (n_u, L) in rad of one realisation by the plan: random, or optimised from there for a low crest factor."""
    drawn = random_phases(plan, realisation)
    return optimise_crest(plan.amplitude, drawn, plan.lines) if plan.crest == "optimised" else drawn


def multisine_spectra(plan: MultisinePlan, realisation: int) -> np.ndarray:
    """Torque phasors Γ (L, n_u, n_u) in N m of eq. (25): rows are axes, column e is experiment e.

    Γ(k) = diag(A_i(k) exp(jφ_i(k))) T, so an experiment drives axis i with A_i / √n_u at every line, ΓΓᴴ = diag(A_i²),
    and the inverse of Γ is as well conditioned as the amplitudes allow.
    """
    diagonal = np.asarray(plan.amplitude) * np.exp(1j * phases(plan, realisation))
    return diagonal.T[:, :, None] * orthogonal_matrix(diagonal.shape[0])


def excitation_torque(plan: MultisinePlan, realisation: int, experiment: int, sign: int = 1) -> np.ndarray:
    """One period (samples, n_u) of the excitation torque in N m at the control rate; row 0 is t = 0."""
    column = sign * multisine_spectra(plan, realisation)[:, :, experiment]
    samples = samples_per_period(plan.base_frequency_hz, 1.0 / plan.rate_hz)
    return synthesise(column, plan.lines, samples)


def synthesise(phasors: np.ndarray, lines: Sequence[int] | np.ndarray, samples: int) -> np.ndarray:
    """One period (samples, …) of the real signal whose line k has the phasor of (L, …) `phasors`."""
    lines = np.asarray(lines)
    if lines.size and 2 * lines.max() >= samples:
        raise FlexcalError(
            "E-FRF-021",
            f"the line {lines.max()} needs more than {2 * lines.max()} samples a period, not {samples}; "
            "raise the rate or lower the band.",
        )
    bins = np.zeros((samples // 2 + 1, *phasors.shape[1:]), complex)
    bins[lines] = phasors * (samples / 2.0)
    return np.fft.irfft(bins, samples, axis=0)


def reference_trajectory(
    plan: MultisinePlan, t: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The reference motion added to every excited axis at times t (s): angle rad, velocity rad/s, acceleration rad/s²."""
    omega = 2.0 * np.pi * plan.reference_frequency_hz
    sine, cosine = np.sin(omega * np.asarray(t)), np.cos(omega * np.asarray(t))
    amplitude = plan.reference_amplitude
    return amplitude * sine, amplitude * omega * cosine, -amplitude * omega**2 * sine


def samples_per_period(base_frequency_hz: float, time_step: float) -> int:
    """Samples in one period; raises `FlexcalError` if the period is not a whole number of steps (leakage would follow)."""
    samples = 1.0 / (base_frequency_hz * time_step)
    if abs(samples - round(samples)) > 1e-6 * samples:
        raise FlexcalError(
            "E-FRF-022",
            f"a period of {1.0 / base_frequency_hz:g} s is not a whole number of samples of {time_step:g} s "
            f"({samples:.6f}); choose a base frequency that divides the rate.",
        )
    return round(samples)


def crest_factor(signal: np.ndarray) -> np.ndarray:
    """Crest factor, peak over root mean square, of each column of the signals (samples, …)."""
    return np.abs(signal).max(0) / np.sqrt(np.mean(np.square(signal), 0))


def optimise_crest(
    amplitude: np.ndarray, start: np.ndarray, lines: np.ndarray, iterations: int = 200
) -> np.ndarray:
    """Phases (n_u, L) of low crest factor, starting at the phases `start`, jointly over the n_u experiments.

    In experiment e axis p carries its multisine with all phases turned by 2π(p-1)(e-1)/n_u, so each axis has one phase
    vector and n_u signals to keep low. Clip and swap (Van der Ouderaa, Schoukens and Renneboog 1988): clip all n_u
    signals, turn them back, take the phases of their mean; the largest crest factor decides which iterate is kept.
    Start it from random phases: the realisations stay different, which the average over nonlinear distortion needs.
    """
    amplitude, lines = np.asarray(amplitude, float), np.asarray(lines)
    n_u = amplitude.shape[0]
    samples = 1 << int(np.ceil(np.log2(_PEAK_SAMPLES_PER_LINE * lines.max())))
    turn = np.sqrt(n_u) * orthogonal_matrix(n_u)  # (axis, experiment)
    current, best = np.array(start, float), np.array(start, float)
    lowest = np.full(n_u, np.inf)
    for step in range(iterations + 1):
        phasors = (amplitude * np.exp(1j * current)).T[:, :, None] * turn
        signals = synthesise(phasors, lines, samples)
        crest = crest_factor(signals).max(-1)
        better = crest < lowest
        best[better], lowest[better] = current[better], crest[better]
        level = (0.80 + 0.19 * step / iterations) * np.abs(signals).max(0)
        clipped = np.fft.rfft(np.clip(signals, -level, level), axis=0)[lines]
        current = np.angle((clipped * turn.conj()).sum(-1)).T
    return best
