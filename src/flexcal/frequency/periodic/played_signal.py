"""Signals of a multisine plan as a robot's controller plays them: soft start, whole periods, soft stop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic.multisine import multisine_spectra, reference_trajectory, synthesise

RAMP_S = 1.0
"""Duration of soft start and soft stop, s."""
MOST_VALUES, MOST_INSTANTS = 1e7, 5e5
"""Largest number of values, over all joints, and of instants of a signal that is checked."""
_ROUNDING = 1e-9
"""Samples by which a whole number of them may be missed."""
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class PlayedSchedule:
    """Samples of a played signal of `plan` at its rate: `ramp` of soft start, `main` of all periods, `ramp` of soft stop.

    The first `loop` samples of `main` repeat themselves: the common period of excitation and reference motion, all of `main` where there
    is none in whole samples. A file holds `rows`: soft start, one loop, soft stop.
    """

    plan: MultisinePlan

    def __post_init__(self) -> None:
        plan = self.plan
        values = self.samples * plan.joint_count
        # instants of the highest line, and of the reference motion, at which limits are checked and signals are searched
        instants = (plan.duration + 2 * RAMP_S) * max(
            plan.frequencies_hz[-1] * 16, plan.reference_frequency_hz * 80, 50.0
        )
        if values > MOST_VALUES or instants > MOST_INSTANTS:
            raise FlexcalError(
                "E-EXP-026",
                f"a signal of the plan '{plan.name}' lasts {plan.duration:.4g} s, with lines up to {plan.frequencies_hz[-1]:.4g} Hz, at "
                f"{plan.rate_hz:.6g} Hz, which is too long to play: give fewer periods, a lower band or a lower rate.",
            )

    @cached_property
    def ramp(self) -> int:
        """Samples of soft start, and of soft stop."""
        return int(np.ceil(RAMP_S * self.plan.rate_hz - _ROUNDING))

    @cached_property
    def main(self) -> int:
        """Samples of all periods; where they are no whole samples, up to one more."""
        return int(np.ceil(self.plan.periods * self.plan.rate_hz / self.plan.base_frequency_hz - _ROUNDING))

    @cached_property
    def period(self) -> int | None:
        """Samples of one period; None where it is no whole number of them."""
        samples = self.plan.rate_hz / self.plan.base_frequency_hz
        return round(samples) if abs(samples - round(samples)) <= _ROUNDING * samples else None

    @cached_property
    def loop(self) -> int:
        """Samples after which excitation and reference motion repeat themselves; `main` if that is longer."""
        plan = self.plan
        turns = plan.reference_frequency_hz / plan.base_frequency_hz if plan.reference_amplitude else 0.0
        for periods in range(1, plan.periods):
            whole = abs(periods * turns - round(periods * turns)) <= _ROUNDING * max(1.0, turns)
            if self.period is not None and whole:
                return periods * self.period
        return self.main

    @property
    def samples(self) -> int:
        """Samples of the whole signal."""
        return self.main + 2 * self.ramp

    @property
    def start(self) -> float:
        """Time of the first sample of the measured periods, s."""
        return self.ramp / self.plan.rate_hz + self.plan.settle_periods / self.plan.base_frequency_hz

    def rows(self) -> np.ndarray:
        """Numbers of the samples that a file with one loop holds."""
        after = self.ramp + self.main + np.arange(self.ramp)
        return np.concatenate([np.arange(self.ramp + self.loop), after])


@dataclass(frozen=True, eq=False)
class PlayedSignal:
    """Signal of one recording, N samples from rest to rest in a pose, of all n joints, joint side.

    Attributes
    ----------
    pose, realisation, experiment, sign : int
        Its place in the plan: indices from 0, and ±1.
    time : ndarray
        Times (N,), s, from the first sample.
    position, velocity : ndarray
        Reference (N, n) of the motors, rad and rad/s.
    torque : ndarray
        Torque (N, n), N m, to be added to the controller's, or that its position controller makes of the reference.
    start : float
        Time at which the measured periods begin, s.
    """

    pose: int
    realisation: int
    experiment: int
    sign: int
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray
    start: float


def played_signals(
    plan: MultisinePlan, *, whole: bool = True, motions: Sequence[np.ndarray] | None = None
) -> Iterator[PlayedSignal]:
    """Signals that a robot's controller plays for a plan of frequency experiments, at the plan's rate.

    From rest in the pose, reference motion and excitation grow within a second as a polynomial of degree 5, run for all periods of the
    plan (settling, then measured), and decay again. Where a period is no whole number of samples, they are samples of the same multisine.

    Parameters
    ----------
    plan : MultisinePlan
        The plan; `dataclasses.replace(plan, rate_hz=…)` plays it at another rate.
    whole : bool
        Whether the whole signal is returned, or as files hold it: soft start, one period of excitation and reference, soft stop.
    motions : sequence of ndarray, optional
        For a position-controlled robot: of every pose the reference motion (L, n_u, n_u), rad/(N m), that makes a unit of each torque. It
        is added to `position` and `velocity`.

    Returns
    -------
    iterator of PlayedSignal
        By pose, realisation, experiment and sign (+1, then −1), as recordings are.

    Raises
    ------
    FlexcalError
        Where a signal has more than 1e7 values or lasts too long for its highest line, and where a line needs a higher rate.

    Examples
    --------
    >>> from flexcal import RobotModel, frequency_plan, played_signals
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = frequency_plan(model, "examples/tx90l/frequency_poses.csv", "default", seed=0)
    >>> signal = next(played_signals(plan))
    >>> signal.torque.shape, signal.start
    ((72000, 6), 9.0)
    """
    schedule = PlayedSchedule(plan)
    rows = np.arange(schedule.samples) if whole else schedule.rows()
    time = rows / plan.rate_hz
    offset, rate, _ = reference_motion(schedule, time)
    moved = np.isin(np.arange(plan.joint_count), plan.joints)
    for pose, q in enumerate(plan.poses):
        position, velocity = q + offset[:, None] * moved, rate[:, None] * moved
        for realisation in range(plan.realisations):
            for experiment in range(plan.experiments):
                torque = np.zeros((len(rows), plan.joint_count))
                torque[:, list(plan.joints)] = _excitation(schedule, realisation, experiment)[rows]
                added = np.zeros((2, len(rows), plan.joint_count))
                if motions is not None:
                    phasors = multisine_spectra(plan, realisation)[:, :, experiment]
                    moving = np.einsum("lij,lj->li", motions[pose], phasors)
                    added[:, :, list(plan.joints)] = _swung(schedule, moving)[:, rows]
                for sign in (1, -1) if plan.signs else (1,):
                    yield PlayedSignal(
                        pose,
                        realisation,
                        experiment,
                        sign,
                        time,
                        position + sign * added[0],
                        velocity + sign * added[1],
                        sign * torque,
                        schedule.start,
                    )


def multisine_at(phasors: np.ndarray, frequencies_hz: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Values (N, …) at times (N,), s, of the signal with the phasors (L, …) at `frequencies_hz` (L,)."""
    flat = phasors.reshape(len(phasors), -1)
    real, imaginary = np.real(flat), np.imag(flat)
    parts = []
    for first in range(0, len(time), _CHUNK):
        turns = time[first : first + _CHUNK, None] * frequencies_hz
        angle = 2 * np.pi * (turns - np.rint(turns))
        parts.append(np.cos(angle) @ real - np.sin(angle) @ imaginary)
    return np.concatenate(parts).reshape(len(time), *phasors.shape[1:])


def envelope(schedule: PlayedSchedule, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share (N,) of the amplitude at times (N,), s, and its first and second derivative."""
    plan, ramp = schedule.plan, schedule.ramp / schedule.plan.rate_hz
    stop = (schedule.ramp + schedule.main) / plan.rate_hz
    length = (schedule.samples - 1) / plan.rate_hz
    fall = length - stop
    after = time > stop
    u = np.clip(np.where(after, (length - time) / fall, time / ramp), 0.0, 1.0)
    by_time = np.where(after, -1 / fall, 1 / ramp)
    return (
        soft(u),
        30 * u**2 * (1 - u) ** 2 * by_time,
        60 * u * (1 - u) * (1 - 2 * u) * by_time**2,
    )


def soft(u: np.ndarray) -> np.ndarray:
    """Polynomial of degree 5 from 0 at u ≤ 0 to 1 at u ≥ 1, at rest at both ends to the second derivative."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)


def reference_motion(schedule: PlayedSchedule, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reference motion (N,) of every excited axis from the pose on at times (N,), s: rad, rad/s, rad/s²."""
    share, change, bend = envelope(schedule, time)
    angle, rate, acceleration = reference_trajectory(
        schedule.plan, time - schedule.ramp / schedule.plan.rate_hz
    )
    return (
        share * angle,
        share * rate + change * angle,
        share * acceleration + 2 * change * rate + bend * angle,
    )


@lru_cache(maxsize=12)
def _excitation(schedule: PlayedSchedule, realisation: int, experiment: int) -> np.ndarray:
    """Torque (samples, n_u) of an experiment of one realisation, the same in all poses."""
    return _swung(schedule, multisine_spectra(schedule.plan, realisation)[:, :, experiment])[0]


def _swung(schedule: PlayedSchedule, phasors: np.ndarray) -> np.ndarray:
    """Signal of phasors (L, n_u) under the envelope, and its derivative (2, samples, n_u)."""
    plan, samples = schedule.plan, np.arange(schedule.samples)
    share, change, _ = (part[:, None] for part in envelope(schedule, samples / plan.rate_hz))
    both = np.stack([phasors, 2j * np.pi * plan.frequencies_hz[:, None] * phasors], axis=1)
    if schedule.period is None:
        values = multisine_at(both, plan.frequencies_hz, (samples - schedule.ramp) / plan.rate_hz)
    else:
        values = synthesise(both, plan.lines, schedule.period)[(samples - schedule.ramp) % schedule.period]
    value, slope = values[:, 0], values[:, 1]
    return np.stack([share * value, share * slope + change * value])
