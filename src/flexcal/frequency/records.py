"""What is kept of the recordings of one pose while they stream by: spectra at the lines, and the mean position."""

import numpy as np

from flexcal.data import MultisinePlan, Recording
from flexcal.errors import FlexcalError
from flexcal.frequency import covariance as cov
from flexcal.frequency import multisine
from flexcal.frequency.spectrum import (
    ExperimentSpectra,
    kept_samples,
    noise_in_half_sum,
    noise_lines,
    spectrum,
    torque_hold,
)


class PoseRecords:
    """Collects the recordings of one pose of a plan; holds spectra only, so any number of recordings fits in memory.

    The first row of a recording is the start of its experiment (excitation and reference at t = 0), whatever its clock.
    """

    def __init__(self, plan: MultisinePlan, pose: int) -> None:
        self.plan = plan
        self.pose = pose
        self._axes = np.asarray(plan.joints)
        signs = (1, -1) if plan.signs else (1,)
        experiments = range(len(plan.joints))
        self._expected = [(r, e, s) for r in range(plan.realisations) for e in experiments for s in signs]
        self._empty_lines = noise_lines(plan)
        self._excited: dict[tuple[int, int, int], np.ndarray] = {}
        self._empty: dict[tuple[int, int, int], np.ndarray] = {}
        self._position = np.zeros(np.shape(plan.poses)[-1])
        self._time_step: float | None = None

    @property
    def time_step(self) -> float:
        """Sample time (s) of the recordings."""
        if self._time_step is None:
            raise FlexcalError(f"There is no recording of pose {self.pose}; record it or name another pose.")
        return self._time_step

    @property
    def q_mean(self) -> np.ndarray:
        """Mean motor position (n,) rad over the kept periods of all recordings."""
        return self._position / max(len(self._excited), 1)

    @property
    def complete(self) -> bool:
        """Whether every realisation, experiment and sign is there."""
        return len(self._excited) == len(self._expected)

    def check_complete(self) -> None:
        """Raise `FlexcalError` with the first recording that is missing."""
        missing = [key for key in self._expected if key not in self._excited]
        if missing:
            realisation, experiment, sign = missing[0]
            raise FlexcalError(
                f"{len(missing)} of {len(self._expected)} recordings of pose {self.pose} are missing, the first is "
                f"realisation {realisation}, experiment {experiment}, sign {sign:+d}; record them."
            )

    def add(self, recording: Recording) -> None:
        """Take in one recording; `FlexcalError` where it is double, too short, or of another sample time."""
        label = recording.label
        if label is None:
            raise FlexcalError("A recording has no label (pose, realisation, experiment, sign); give it one.")
        key = (label.realisation, label.experiment, label.sign)
        if key not in self._expected or key in self._excited:
            state = "is there twice" if key in self._excited else "is not in the plan"
            raise FlexcalError(
                f"The recording of pose {label.pose}, realisation {key[0]}, experiment {key[1]}, sign {key[2]:+d} "
                f"{state}; remove it."
            )
        if self._time_step is None:
            self._time_step = recording.time_step
        elif abs(recording.time_step - self._time_step) > 1e-9 * self._time_step:
            raise FlexcalError(
                f"The recordings of pose {self.pose} have sample times {self._time_step:g} and "
                f"{recording.time_step:g} s; record them all at one rate."
            )
        rows = kept_samples(self.plan, recording)
        periods = self.plan.periods - self.plan.settle_periods
        between = not noise_in_half_sum(self.plan)
        position, torque = recording.q[rows], recording.torque[rows]
        if not between:  # only whole lines are wanted: average the periods before anything is copied
            position, torque = _average(position, periods), _average(torque, periods)
            periods = 1
        mean = position.mean(0)
        signal = np.hstack([position[:, self._axes] - mean[self._axes], torque[:, self._axes]])
        if not np.isfinite(signal).all():
            raise FlexcalError(
                f"A recording of pose {self.pose} holds a NaN or an infinite number; record it again."
            )
        self._excited[key] = spectrum(signal, periods, self.plan.lines)
        if between:
            self._empty[key] = spectrum(signal, periods, self._empty_lines)
        self._position += mean

    def spectra(self, pooled_lines: int) -> ExperimentSpectra:
        """The spectra of all realisations: signs subtracted, hold corrected, noise pooled over neighbouring bins."""
        plan, n = self.plan, self._axes.size
        members = range(plan.realisations)
        columns = self._difference(self._excited)
        if noise_in_half_sum(plan):
            half_sum = 0.5 * (self._stack(self._excited, 1) + self._stack(self._excited, -1))
            empty = half_sum[:, :, np.isin(plan.lines, self._empty_lines)]
        else:
            empty = self._difference(self._empty)
        lines = np.asarray(plan.lines)
        omega = 2.0 * np.pi * plan.base_frequency_hz * lines
        hold = torque_hold(plan, omega, self.time_step)
        factor = np.concatenate([np.repeat(-(omega**2)[:, None], n, 1), np.repeat(hold[:, None], n, 1)], 1)
        columns = np.moveaxis(columns * factor, 1, -1)  # (R, L, 2n, E)
        empty = empty.transpose(2, 0, 1, 3).reshape(empty.shape[2], -1, 2 * n)
        noise = cov.column_noise(empty, self._empty_lines, lines, pooled_lines)
        return ExperimentSpectra(
            acceleration=columns[..., :n, :],
            torque=columns[..., n:, :],
            excitation=np.stack([multisine.spectra(plan, member) for member in members]),
            noise=noise * factor[:, :, None] * factor[:, None, :].conj(),
        )

    def _difference(self, spectra: dict[tuple[int, int, int], np.ndarray]) -> np.ndarray:
        """(plus - minus)/2, or plus alone: (R, E, lines, 2n)."""
        plus = self._stack(spectra, 1)
        return 0.5 * (plus - self._stack(spectra, -1)) if self.plan.signs else plus

    def _stack(self, spectra: dict[tuple[int, int, int], np.ndarray], sign: int) -> np.ndarray:
        """(R, E, lines, 2n)"""
        experiments = range(len(self.plan.joints))
        return np.stack([[spectra[r, e, sign] for e in experiments] for r in range(self.plan.realisations)])


def _average(signal: np.ndarray, periods: int) -> np.ndarray:
    return signal.reshape(periods, -1, signal.shape[1]).mean(0)
