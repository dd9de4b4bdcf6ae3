"""Logs of commanded and measured joint positions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.recordings.log_files import check_time
from flexcal.data.recordings.time_base import uniform_blocks
from flexcal.data.tables import assign, check_joint_units, open_table, timestamp_columns, with_seconds

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_OTHERS = ("tau", "dq", "ddq", "qa", "tau_ext", "temperature")
"""Quantities that a log may have besides, and that are not used."""


@dataclass(frozen=True, eq=False)
class CommandLog:
    """Commanded and measured joint positions (N, n), rad or m, at `start` + k · `time_step`, s; `name` is what messages call it."""

    time_step: float
    command: np.ndarray
    q: np.ndarray
    start: float = 0.0
    name: str = "a log"

    def __len__(self) -> int:
        return self.q.shape[0]

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return self.time_step * (len(self) - 1)


def read_command_log(path: str | Path, model: RobotModel) -> CommandLog:
    """Read `t`, `q1` … `qn` and the commands `qc1` … `qcn` of a log, or what `signals:` of robot.yaml names in their stead.

    Raises `InputError` as `read_recording` does; a gap of the time stamps ends in an error too.
    """
    file = open_table(path)
    signals = assign(file, model, ("t", "q", "qc"), _OTHERS)
    texts = timestamp_columns(signals)
    (table,) = with_seconds([file.read(texts)], texts)
    t = signals["t"].values(table)[:, 0]
    check_time(table, signals["t"], t, None)
    parts = [signals[quantity].values(table) for quantity in ("q", "qc")]
    for quantity, values in zip(("q", "qc"), parts, strict=True):
        check_joint_units(model, table, signals[quantity], values)
    (base, whole), *others = uniform_blocks([(t, np.concatenate(parts, axis=1))], positions=model.n)
    if others:
        later = others[0][0]
        raise table.error(
            "E-LOG-023",
            int(np.argmax(t > later.start - 0.5 * later.time_step)),
            signals["t"].columns[0],
            f"a gap of {later.gap:.6g} s precedes this sample; cut the log there into two files.",
        )
    return CommandLog(base.time_step, whole[:, model.n :], whole[:, : model.n], base.start, str(path))
