"""Recordings of played signals: which signal of the plan, from when on, and on the plan's own samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import ceil

import numpy as np

from flexcal.data.plans import MultisinePlan, TrajectoryPlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic.line_spectra import spectrum
from flexcal.frequency.periodic.multisine import multisine_spectra
from flexcal.frequency.periodic.played_signal import RAMP_S, PlayedSchedule, multisine_at, soft

LEAST = 0.3
"""Least correlation of a recorded torque with its signal; that with any other signal of the plan is about 0.1."""
CLEAR = 1.25
"""Least ratio of the best correlation to the second."""
HIGHEST = 0.4
"""Highest line relative to the rate of a log: the interpolation passes what is below."""
SAME_POSE = 0.1
"""Largest distance of a recording from a pose of the plan, rad or m."""
_NEARLY = 0.02
"""Difference of distances, rad or m, below which two poses are as near, since soft control sags."""
_COARSE = 5
"""Samples a period of the highest line in the search."""
_BAND = (0.8, 1.2)
"""Margins of the band of the search, relative to the lowest and the highest line."""
_CUT = 0.98
"""Weight of a place where the log does not have all periods."""
_TAPS = 16
"""Samples on either side of an interpolated one."""
_WINDOW = 9.0
"""Shape parameter of the Kaiser window of the interpolation: stop band 90 dB down."""
_SAME_SAMPLES = 0.1
"""Samples by which a log's time may depart from the plan's over all periods without being interpolated."""
_MOTION_INSTANTS = 400
"""Instants of a period of a trajectory in the search."""
_MOTION_DIFFERS, _MOTION_CLEAR, _MOTION_ALIKE = 0.05, 4.0, 1e-3
"""Largest mean squared distance from a trajectory, relative to its variance; least ratio of the second to it; difference that is none."""
_REFINEMENTS = 2
_CERTAIN, _LEAST_DRIFT = 5.0, 0.01
"""Standard deviations, and phase of the highest line, rad, beyond which the drift of a log's clock while settling is corrected."""


@dataclass(frozen=True, eq=False)
class Recognition:
    """A recording of the signal `label` of a plan, whose excitation begins at `start`, s, on the clock of the log.

    That clock counts `clock` s in one of the controller. `correlation` of its torque with that signal is between 0 and 1, and `second` the
    largest with another one.
    """

    label: RecordingLabel
    start: float
    clock: float
    correlation: float
    second: float


class SignalSearch:
    """Search for the signals of a plan in recorded torques."""

    def __init__(self, plan: MultisinePlan) -> None:
        self.plan = plan
        PlayedSchedule(plan)  # raises where it is too long
        self._axes = list(plan.joints)
        self._members = [(r, e) for r in range(plan.realisations) for e in range(plan.experiments)]
        spectra = [multisine_spectra(plan, realisation) for realisation in range(plan.realisations)]
        self._phasors = [spectra[r][:, :, e] for r, e in self._members]
        self._weight = 1 / np.sqrt(np.sum(np.square(plan.amplitude), axis=1))
        self._step = 1 / (_COARSE * plan.frequencies_hz[-1])
        self._ramp, self._main = int(RAMP_S / self._step), int(plan.duration / self._step)
        time = self._step * np.arange(-self._ramp, self._main + self._ramp)
        # (samples, n_u, members)
        shapes = multisine_at(np.stack(self._phasors, axis=-1), plan.frequencies_hz, time)
        shapes = shapes * self._weight[:, None]
        outside = np.maximum(-time, time - plan.duration) / RAMP_S
        self._shapes = soft(1 - outside)[:, None, None] * shapes
        self._powers = _cumulative(np.sum(self._shapes**2, axis=1))
        self._transform: tuple[int, np.ndarray] = (0, np.zeros(0))

    def find(self, recording: Recording, poses: Sequence[int]) -> Recognition:
        """The signal of a recording in one of `poses`, the first of which is taken; see `nearest_poses`.

        Raises `FlexcalError` where it is shorter than the plan's periods, or no signal of the plan is in its torques, or more than one.
        """
        plan = self.plan
        _require_whole(recording, plan)
        if plan.frequencies_hz[-1] * recording.time_step > HIGHEST:
            raise FlexcalError(
                "E-EXP-027",
                f"{recording.name}: the log has {1 / recording.time_step:.6g} samples a second, too few for the plan's lines up to "
                f"{plan.frequencies_hz[-1]:.4g} Hz; log at {plan.frequencies_hz[-1] / HIGHEST:.4g} Hz or more.",
            )
        signed, lags, shares = self._correlations(recording)
        order = np.argsort(-np.abs(signed))
        best = int(order[0])
        second = float(shares[order[1]]) if len(order) > 1 else 0.0
        correlation = float(shares[best])
        if correlation < max(LEAST, CLEAR * second):
            raise FlexcalError(
                "E-EXP-014",
                f"{recording.name}: no signal of the plan is found in its torques (the best correlation is {correlation:.2f}, the second "
                f"{second:.2f}); check that it is a recording of this plan, and the columns and signs of tau.",
            )
        sign = 1 if signed[best] > 0 else -1
        if sign < 0 and not plan.signs:
            raise FlexcalError(
                "E-EXP-015",
                f"{recording.name}: its torques are those of the plan with the opposite sign; correct the sign of tau under `signals:`.",
            )
        realisation, experiment = self._members[best]
        label = RecordingLabel(poses[0], realisation, experiment, sign)
        start = recording.start + lags[best] * self._step
        phasors, last = sign * self._phasors[best], plan.settle_periods
        for _ in range(_REFINEMENTS):
            measured = self._lines(recording, start, phasors, last)
            start += self._delay(np.angle(measured), np.sqrt(np.abs(measured)), controlled=True)[0]
        clock = 1.0
        if last:
            early, late = (self._lines(recording, start, phasors, skipped) for skipped in (0, last))
            change = late * early.conj()
            drift, std = self._delay(np.angle(change), np.sqrt(np.abs(change)), controlled=False)
            if abs(drift) > max(_CERTAIN * std, _LEAST_DRIFT / (2 * np.pi * plan.frequencies_hz[-1])):
                clock = 1 + drift * plan.base_frequency_hz / last
                # the phases were those in the middle of the measured periods
                start -= (clock - 1) * (last + plan.periods) / 2 / plan.base_frequency_hz
        return Recognition(label, start, clock, correlation, second)

    def _correlations(self, recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of every signal, where it fits best: projection of the torque on it, with its sign, the search's samples before its first
        period, and its correlation (each (members,)).

        Half a period later an odd multisine is the same with the other sign: soft start and soft stop are parts of the signals, as far as
        the log has them, and a place where the log has all periods is preferred.
        """
        torque = self._weight * recording.torque[:, self._axes]
        lines = np.fft.rfft(torque - torque.mean(axis=0), axis=0)
        frequencies = np.fft.rfftfreq(len(torque), recording.time_step)
        low, high = self.plan.frequencies_hz[[0, -1]] * _BAND
        lines[(frequencies < low) | (frequencies > high)] = 0.0
        passed = np.fft.irfft(lines, len(torque), axis=0)
        count = max(self._main, int((len(recording) - 1) * recording.time_step / self._step) + 1)
        at = np.minimum(self._step / recording.time_step * np.arange(count), len(recording) - 1)
        beyond = self._main // 2
        coarse = np.pad(sampled(passed, at), ((self._ramp + beyond,) * 2, (0, 0)))
        size = 1 << int(np.ceil(np.log2(len(coarse) + len(self._shapes))))
        if self._transform[0] != size:
            self._transform = size, np.fft.rfft(self._shapes, size, axis=0).conj()
        product = np.einsum("fa,fam->fm", np.fft.rfft(coarse, size, axis=0), self._transform[1])
        lags = np.arange(-beyond, count - self._main + 1 + beyond)
        inner = np.fft.irfft(product, size, axis=0)[: len(lags)]
        begin = np.clip(self._ramp - lags, 0, len(self._shapes))
        end = np.clip(self._ramp + count - lags, 0, len(self._shapes))
        energy = np.maximum(self._powers[end] - self._powers[begin], np.finfo(float).tiny)
        projection = inner / np.sqrt(energy)
        inside = ((lags >= 0) & (lags <= count - self._main))[:, None]
        best = np.argmax(np.abs(projection) * np.where(inside, 1.0, _CUT), axis=0)
        signed = projection[best, range(projection.shape[1])]
        power = _cumulative(np.sum(coarse**2, axis=1))
        total = power[best + end[best]] - power[best + begin[best]]
        return signed, lags[best], np.abs(signed) / np.sqrt(np.maximum(total, np.finfo(float).tiny))

    def _lines(self, recording: Recording, start: float, phasors: np.ndarray, skipped: int) -> np.ndarray:
        """Torque at the lines (L,) with the excitation's `phasors` (L, n_u), which begins at `start`, as phase reference, over all axes.

        Of as many periods as are measured, after those `skipped`.
        """
        plan = self.plan
        kept = plan.periods - plan.settle_periods
        samples = kept * ceil(2 * _COARSE * plan.lines[-1])
        step = kept / plan.base_frequency_hz / samples
        first = start + skipped / plan.base_frequency_hz
        at = (first - recording.start + step * np.arange(samples)) / recording.time_step
        torque = sampled(recording.torque[:, self._axes], np.clip(at, 0, len(recording) - 1))
        return np.sum(spectrum(torque, kept, plan.lines) * self._weight**2 * phasors.conj(), axis=1)

    def _delay(self, angle: np.ndarray, weight: np.ndarray, *, controlled: bool) -> tuple[float, float]:
        """Delay, s, of which `angle` (L,) is the phase at the lines, and its standard deviation.

        The phases are fitted by -ω δ, or if `controlled` by -ω δ + b/ω: the second term is that of a controller, which takes up a part of
        the excitation by friction and damping.
        """
        omega = 2 * np.pi * self.plan.frequencies_hz
        columns = np.stack([-omega, 1 / omega], axis=1)[:, : 2 if controlled and len(omega) > 2 else 1]
        columns, angle = columns * weight[:, None], angle * weight
        solution = np.linalg.lstsq(columns, angle, rcond=None)[0]
        freedom = max(1, len(omega) - columns.shape[1])
        variance = np.sum((angle - columns @ solution) ** 2) / freedom
        return float(solution[0]), float(np.sqrt(variance * np.linalg.pinv(columns.T @ columns)[0, 0]))


def _require_whole(recording: Recording, plan: MultisinePlan | TrajectoryPlan) -> None:
    """Raise `FlexcalError` for a recording that is shorter than the plan's periods."""
    if (len(recording) + 0.5) * recording.time_step < plan.duration:
        raise FlexcalError(
            "E-EXP-013",
            f"{recording.name}: the log lasts {len(recording) * recording.time_step:.4g} s, less than the {plan.duration:g} s of the "
            f"plan's {plan.periods} periods; record all of them.",
        )


class MotionSearch:
    """Search for the trajectories of a plan in recorded positions."""

    def __init__(self, plan: TrajectoryPlan) -> None:
        self.plan = plan
        self._step = 1 / (_MOTION_INSTANTS * plan.base_frequency_hz)
        periods = plan.periods - plan.settle_periods
        time = self._step * np.arange(_MOTION_INSTANTS * periods)
        self._paths = np.array([plan.motion(number, time)[0] for number in range(len(plan))])
        self._mean = self._paths.mean(axis=1, keepdims=True)
        self._size = np.sqrt(np.mean((self._paths - self._mean) ** 2, axis=(0, 1)))
        self._size = np.where(self._size > 0, self._size, 1.0)

    def find(self, recording: Recording) -> Recognition:
        """The trajectory of a recording, by the least squared distance of its positions from the measured periods.

        Raises `FlexcalError` where it is shorter than the plan's periods, or none of the trajectories is in it, or more than one.
        """
        plan = self.plan
        _require_whole(recording, plan)
        settling = plan.settle_periods / plan.base_frequency_hz
        ratio = self._step / recording.time_step
        first = np.arange(int((len(recording) - 1) / ratio) + 1)
        q = sampled(recording.q, ratio * first) / self._size
        lags = np.arange(len(q) - self._paths.shape[1] + 1)
        lags = lags[lags * self._step > settling - self._step]
        shares, places = zip(*(self._distances(q, number, lags) for number in range(len(plan))), strict=True)
        order = np.argsort(shares)
        best, share = int(order[0]), float(shares[order[0]])
        second = float(shares[order[1]]) if len(order) > 1 else np.inf
        if share > _MOTION_DIFFERS or second < _MOTION_CLEAR * share:
            raise FlexcalError(
                "E-EXP-025",
                f"{recording.name}: none of the plan's trajectories, or more than one, fits its positions (the nearest departs by "
                f"{100 * np.sqrt(share):.0f} % of its range); check that it is a recording of this plan, and the columns of q.",
            )
        spare = len(recording) * recording.time_step - plan.duration
        after = float(np.clip(places[best] * self._step - settling, 0.0, max(spare, 0.0)))
        label = RecordingLabel(0, best, 0, 1)
        return Recognition(label, recording.start + after, 1.0, 1 - share, 1 - min(second, 1.0))

    def _distances(self, q: np.ndarray, number: int, lags: np.ndarray) -> tuple[float, float]:
        """Least mean squared distance from a trajectory, relative to its variance, and where: the last place that is about as good."""
        path = self._paths[number] / self._size
        size = 1 << int(np.ceil(np.log2(len(q) + len(path))))
        product = np.fft.rfft(q, size, axis=0) * np.fft.rfft(path, size, axis=0).conj()
        inner = np.fft.irfft(product.sum(axis=1), size)[lags]
        power = _cumulative(np.sum(q**2, axis=1))
        distance = power[lags + len(path)] - power[lags] - 2 * inner + np.sum(path**2)
        distance /= np.sum((path - self._mean[number] / self._size) ** 2)
        least = float(distance.min())
        at = int(np.flatnonzero(distance <= least + _MOTION_ALIKE)[-1])
        while at > 0 and distance[at - 1] < distance[at]:
            at -= 1
        place = float(lags[at])
        if 0 < at < len(lags) - 1:
            before, here, after = distance[at - 1 : at + 2]
            bend = before - 2 * here + after
            place += 0.5 * (before - after) / bend if bend > 0 else 0.0
        return max(least, 0.0), place


def _cumulative(values: np.ndarray) -> np.ndarray:
    """Sums (N + 1, …) of the first 0 … N of values (N, …)."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])


def nearest_poses(plan: MultisinePlan, recording: Recording) -> list[int]:
    """Poses of the plan in which a recording may be, the nearest first; more than one only where a sagging arm could be in either.

    Raises `FlexcalError` where it is far from all of them.
    """
    apart = np.abs(recording.q.mean(axis=0) - plan.poses).max(axis=1)
    order = np.argsort(apart, kind="stable")
    if apart[order[0]] > SAME_POSE:
        joint = int(np.argmax(np.abs(recording.q.mean(axis=0) - plan.poses[order[0]])))
        raise FlexcalError(
            "E-EXP-016",
            f"{recording.name}: its mean position is {apart[order[0]]:.3g} from the nearest pose of the plan, {order[0] + 1}, at joint "
            f"{joint + 1}; record it in a pose of the plan, or correct q under `signals:`.",
        )
    return [int(pose) for pose in order if apart[pose] <= apart[order[0]] + _NEARLY]


def on_plan(plan: MultisinePlan | TrajectoryPlan, recording: Recording, found: Recognition) -> Recording:
    """The periods of the plan in a recording, from the beginning of the excitation on, in whole samples a period.

    At the plan's rate, of multisines also at the multiple of it that is nearest to the log's, so that a torque held over a sample of the
    plan stays so. Where the log has these samples it is cut to whole ones; else all quantities are interpolated as band-limited signals.

    Raises `FlexcalError` where a part of the periods is not in the log.
    """
    faster = isinstance(plan, MultisinePlan)
    several = max(1, round(1 / (recording.time_step * plan.rate_hz))) if faster else 1
    period = several * ceil(plan.rate_hz / plan.base_frequency_hz * (1 - 1e-9))
    step = found.clock / (plan.base_frequency_hz * period)
    count = plan.periods * period
    first = (found.start - recording.start) / recording.time_step
    same = abs(step / recording.time_step - 1) * count < _SAME_SAMPLES
    if same:
        first = round(first)
        # the first sample is the beginning, as far as phases tell
        if -2 <= first < 0 and len(recording) >= count:
            first = 0
    last = first + (count - 1) * step / recording.time_step
    if first < -0.5 or last > len(recording) - 0.5:
        lacking = -first if first < -0.5 else last - (len(recording) - 1)
        where = "begins" if first < -0.5 else "ends"
        raise FlexcalError(
            "E-EXP-017",
            f"{recording.name}: the log {where} {lacking * recording.time_step:.3g} s too {'late' if where == 'begins' else 'early'} "
            f"to hold all {plan.periods} periods of {found.label.name}; begin it before the signal and end it after.",
        )
    at = first + step / recording.time_step * np.arange(count)

    def part(values: np.ndarray) -> np.ndarray:
        return values[first : first + count] if same else sampled(values, np.clip(at, 0, len(values) - 1))

    whole = {
        field.name: part(values)
        for field in fields(recording)
        if isinstance(values := getattr(recording, field.name), np.ndarray)
    }
    return replace(recording, time_step=step / found.clock, start=0.0, label=found.label, **whole)


def sampled(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (M, …) of a band-limited signal with samples (N, …) at the places `at` (M,) between 0 and N - 1.

    By the sinc function under a Kaiser window of 32 samples; beyond its ends the signal is taken as constant.
    """
    flat = values.reshape(len(values), -1)
    mean = flat.mean(axis=0)
    flat = flat - mean
    result = np.empty((len(at), flat.shape[1]))
    reach = np.arange(-_TAPS + 1, _TAPS + 1)
    for begin in range(0, len(at), 4096):
        place = at[begin : begin + 4096]
        nodes = np.floor(place).astype(int)[:, None] + reach
        offset = place[:, None] - nodes
        window = np.i0(_WINDOW * np.sqrt(np.maximum(0.0, 1 - (offset / _TAPS) ** 2)))
        weights = np.sinc(offset) * window
        weights /= weights.sum(axis=1, keepdims=True)
        result[begin : begin + 4096] = np.einsum(
            "mk,mkc->mc", weights, flat[np.clip(nodes, 0, len(flat) - 1)]
        )
    return (result + mean).reshape(len(at), *values.shape[1:])
