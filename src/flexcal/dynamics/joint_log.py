"""A joint log on disk as an experiment: filtered once, then gone through again and again in blocks, so that it may be of any length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np

from flexcal.data import Recording, read_recording_blocks
from flexcal.dynamics.motion import Motion, filtered_motion
from flexcal.errors import InputError
from flexcal.model import RobotModel

_ROWS = 20_000
"""Rows of the file that are in memory at once."""


@dataclass(frozen=True, eq=False)
class JointLog:
    """The log at `path`, its positions low-pass filtered; the motion lies in the file `filtered`, in so many `parts`.

    It has so many `samples`, every `time_step` (s) from `start` (s) on. `top_speed` (n,) is the largest |q̇| of every joint, `span` are the
    times of the first and the last sample of the log itself, s.
    """

    path: Path
    filtered: Path
    parts: int
    samples: int
    start: float
    time_step: float
    top_speed: np.ndarray
    span: tuple[float, float]

    @classmethod
    def read(cls, path: Path, model: RobotModel, cutoff_hz: float, scratch: Path) -> JointLog:
        """One pass over the log at `path`, filtered at `cutoff_hz` into a file of the folder `scratch`: 192 bytes a sample of six joints.

        Raises `InputError` as `log_blocks` does, and `FlexcalError` as `filtered_motion` does.
        """
        read: list[tuple[float, float, float]] = []

        def watched() -> Iterator[Recording]:
            for recording in log_blocks(path, model):
                read.append((recording.start, recording.start + recording.duration, recording.time_step))
                yield recording

        parts, samples, start, top_speed = 0, 0, 0.0, np.zeros(model.n)
        with NamedTemporaryFile(dir=scratch, suffix=".npy", delete=False) as stream:
            for motion in filtered_motion(watched(), cutoff_hz):
                if not len(motion):
                    continue
                np.save(stream, np.stack([motion.q.T, motion.dq.T, motion.ddq.T, motion.torque.T]))
                start = start if parts else float(motion.time[0])
                parts += 1
                samples += len(motion)
                top_speed = np.maximum(top_speed, motion.top_speed)
        span = (read[0][0], read[-1][1])
        return cls(path, Path(stream.name), parts, samples, start, read[0][2], top_speed, span)

    @property
    def name(self) -> str:
        """The path of the log."""
        return str(self.path)

    def blocks(self) -> Iterator[Motion]:
        """The filtered motion in parts that follow each other."""
        number = 0
        with self.filtered.open("rb") as stream:
            for _ in range(self.parts):
                q, dq, ddq, torque = np.load(stream)
                time = self.start + self.time_step * np.arange(number, number + q.shape[1])
                yield Motion(time, q.T, dq.T, ddq.T, torque.T)
                number += q.shape[1]


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
