"""A joint log on disk as an experiment: read anew in blocks at every pass, so that it may be of any length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from flexcal.data import Recording, read_recording_blocks
from flexcal.dynamics.motion import Motion, filtered_motion
from flexcal.errors import InputError
from flexcal.model import RobotModel

_ROWS = 20_000
"""Rows of the file that are in memory at once."""


@dataclass(frozen=True, eq=False)
class JointLog:
    """The log at `path` of a robot, its positions low-pass filtered at `cutoff_hz`.

    Reading raises `InputError` as `log_blocks` does; filtering raises `FlexcalError` as `filtered_motion` does.
    """

    path: Path
    model: RobotModel
    cutoff_hz: float

    @property
    def name(self) -> str:
        """The path."""
        return str(self.path)

    @property
    def samples(self) -> int:
        """Samples of the filtered motion."""
        return self._summary[0]

    @property
    def top_speed(self) -> np.ndarray:
        """The largest |q̇| of every joint (n,)."""
        return self._summary[1]

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and the last sample of the file, s."""
        return self._summary[2]

    @property
    def time_step(self) -> float:
        """s."""
        return self._summary[3]

    def surveyed(self) -> JointLog:
        """The same, gone through once, so that what it says of itself is known."""
        _ = self._summary
        return self

    def blocks(self) -> Iterator[Motion]:
        """The filtered motion in parts that follow each other."""
        return self._filtered(log_blocks(self.path, self.model))

    def _filtered(self, recordings: Iterator[Recording]) -> Iterator[Motion]:
        return filtered_motion(recordings, self.cutoff_hz, self.model.config.dynamics.torque)

    @cached_property
    def _summary(self) -> tuple[int, np.ndarray, tuple[float, float], float]:
        read: list[tuple[float, float, float]] = []

        def watched() -> Iterator[Recording]:
            for recording in log_blocks(self.path, self.model):
                read.append((recording.start, recording.start + recording.duration, recording.time_step))
                yield recording

        samples, top_speed = 0, np.zeros(self.model.n)
        for motion in self._filtered(watched()):
            samples += len(motion)
            top_speed = np.maximum(top_speed, np.abs(motion.dq).max(axis=0, initial=0.0))
        return samples, top_speed, (read[0][0], read[-1][1]), read[0][2]


def log_blocks(path: Path, model: RobotModel) -> Iterator[Recording]:
    """The recording of a log in parts that follow each other; raises `InputError` as `read_recording` does, and for a gap."""
    for recording in read_recording_blocks(path, model, rows=_ROWS):
        base = recording.time_base
        if base is not None and base.gap > 0:
            raise InputError(
                f"{path}: a gap of {base.gap:.6g} s precedes the sample at {recording.start:.9g} s, where "
                f"{base.time_step:.6g} s is usual; record again, or cut the log there into two files."
            )
        yield recording
