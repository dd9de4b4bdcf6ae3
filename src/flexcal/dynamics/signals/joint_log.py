"""A joint log on disk as an experiment: filtered once, then read in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np

from flexcal.data.recordings import Recording, TimeSummary, read_recording_blocks
from flexcal.dynamics.signals.external_torques import external_torque
from flexcal.dynamics.signals.gravity_torque_check import GravityTorqueCheck
from flexcal.dynamics.signals.log_faults import MOVES, LogFaults
from flexcal.dynamics.signals.motion import FilteredPositions, Motion, filtered_positions
from flexcal.errors import FlexcalError, InputError
from flexcal.files.transaction import open_regular
from flexcal.model.robot import RobotModel

_ROWS = 20_000
"""Number of rows of the file in memory at once."""


@dataclass(frozen=True, eq=False)
class JointLog:
    """The log at `path`, its positions low-pass filtered at `cutoff_hz`: with the torques in the file `filtered`, in parts that begin at
    `starts`, s.

    The motion has so many `samples`, every `time_step` (s). `top_speed` (n,) is the largest |q̇| of every joint, `spans` are the
    times of the first and the last sample before, between and after the gaps of the log itself, s; `time_stamps` says what was done with
    its time stamps, empty where they were uniform. `payload` is kg, as the column `payload` says, None where there is
    none; `weight` is what its torques carry; `wrench` tells whether it has a force sensor's columns; `watch` is told the share of
    the samples that a pass has gone through. A joint that never moves has no
    velocity and no acceleration: what its encoder shows of them is noise, of which friction would take the sign.
    """

    path: Path
    cutoff_hz: float
    filtered: Path
    starts: tuple[float, ...]
    samples: int
    time_step: float
    top_speed: np.ndarray
    rest: np.ndarray
    spans: tuple[tuple[float, float], ...]
    time_stamps: str
    payload: float | None
    weight: GravityTorqueCheck
    wrench: bool = False
    watch: Callable[[float], None] | None = None

    @classmethod
    def read(cls, path: Path, model: RobotModel, cutoff_hz: float, scratch: Path) -> JointLog:
        """One pass over the log at `path`, filtered at `cutoff_hz` into a file of the folder `scratch`: 96 bytes a sample of six joints,
        and 48 for their arm sides.

        Raises `InputError` as `log_blocks` does, for what `LogFaults` finds, and where the log does not suit the filter, and `FlexcalError`
        where the folder cannot take it.
        """
        faults = LogFaults(path, model)
        spans: list[tuple[float, float]] = []
        summary, steps = TimeSummary(), []
        payloads: list[float] = []
        sensed: list[bool] = []
        carried = [GravityTorqueCheck.empty(model.n)]

        def watched() -> Iterator[Recording]:
            for recording in log_blocks(path, model):
                base, end = recording.time_base, recording.start + recording.duration
                steps.append(recording.time_step)
                if base is not None:
                    summary.add(base)
                if spans and not (base and base.gap):
                    spans[-1] = (spans[-1][0], end)
                else:
                    spans.append((recording.start, end))
                if recording.payload is not None:
                    payloads.append(float(recording.payload[0]))
                sensed.append(recording.force is not None)
                carried.append(GravityTorqueCheck.of(recording, model))
                faults.add(recording)
                yield recording
            faults.check()

        starts, samples, top_speed = [], 0, np.zeros(model.n)
        lowest, highest = np.full(model.n, np.inf), np.full(model.n, -np.inf)
        try:
            with NamedTemporaryFile(dir=scratch, suffix=".npy", delete=False) as stream:
                for part in filtered_positions(watched(), cutoff_hz, model.config.dynamics.torque):
                    if not len(part):
                        continue
                    np.save(stream, part.q.T)
                    np.save(stream, part.torque.T)
                    np.save(stream, part.external.T)
                    starts.append(part.start)
                    samples += len(part)
                    motion = part.motion()
                    top_speed = np.maximum(top_speed, motion.top_speed)
                    lowest = np.minimum(lowest, motion.q.min(axis=0))
                    highest = np.maximum(highest, motion.q.max(axis=0))
        except OSError as problem:
            raise FlexcalError(
                "E-DYN-033",
                f"{scratch} cannot take the filtered log ({problem.strerror or problem}); "
                "set TMPDIR to a folder with room for 144 bytes a sample.",
            ) from problem
        except InputError:
            raise
        except FlexcalError as problem:
            raise InputError(problem.code, f"{path}: {problem}") from problem
        rests = highest - lowest < MOVES
        top_speed[rests] = 0.0
        used = tuple(span for span in spans if any(span[0] <= start <= span[1] for start in starts))
        summary.short = sum(end - start for start, end in spans if (start, end) not in used)
        return cls(
            path,
            cutoff_hz,
            Path(stream.name),
            tuple(starts),
            samples,
            steps[0],
            top_speed,
            np.where(rests, 0.5 * (lowest + highest), np.nan),
            used,
            summary.sentence,
            payloads[0] if payloads else None,
            reduce(add, carried),
            any(sensed),
        )

    @property
    def name(self) -> str:
        """The path of the log."""
        return str(self.path)

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and the last sample, s."""
        return self.spans[0][0], self.spans[-1][1]

    def last(self, share: float) -> float:
        """Time from which the last `share` of the recorded time begins, s; gaps do not count."""
        left = share * sum(end - start for start, end in self.spans)
        for start, end in reversed(self.spans):
            if left <= end - start:
                return end - left
            left -= end - start
        return self.span[0]

    def blocks(self) -> Iterator[Motion]:
        """Filtered motion in consecutive parts."""
        seen = 0
        with open_regular(self.filtered, limit=None) as stream:
            for start in self.starts:
                q, torque, external = (np.load(stream).T for _ in range(3))
                yield self.settled(FilteredPositions(start, self.time_step, q, torque, external).motion())
                seen += len(torque)
                if self.watch is not None:
                    self.watch(min(1.0, seen / max(1, self.samples)))

    def settled(self, motion: Motion) -> Motion:
        """Motion of this log with the joints that never move set to rest."""
        moves = np.isnan(self.rest)
        q = np.where(moves, motion.q, self.rest)
        return replace(motion, q=q, dq=moves * motion.dq, ddq=moves * motion.ddq)


def log_blocks(path: Path, model: RobotModel) -> Iterator[Recording]:
    """Recording of a log in parts that are consecutive or follow a gap, by their `time_base`, with the external torque of all loads
    besides the motors.

    Raises `InputError` as `read_recording_blocks` does.
    """
    for recording in read_recording_blocks(path, model, rows=_ROWS):
        yield replace(recording, external_torque=external_torque(model, recording))
