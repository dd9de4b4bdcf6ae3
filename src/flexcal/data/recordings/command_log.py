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
    """Log of commanded and measured joint positions: N samples of n joints at t = start + k · time_step.

    Parameters
    ----------
    time_step : float
        Time between samples, s.
    command : ndarray
        Commanded positions (N, n), rad (m where prismatic).
    q : ndarray
        Measured positions (N, n).
    start : float
        Time of the first sample, s.
    name : str
        What messages call it.
    """

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
    """Read a log of commanded and measured joint positions; where its time stamps jitter, values are interpolated.

    Parameters
    ----------
    path : str or Path
        CSV or Parquet with `t`, `q1` … `qn` and the commands `qc1` … `qcn`, or what `signals:` of robot.yaml names in their stead.
    model : RobotModel
        Robot whose joints the log has.

    Returns
    -------
    CommandLog
        Positions in SI units.

    Raises
    ------
    InputError
        As `read_recording` does.

    Examples
    --------
    >>> from flexcal import RobotModel, read_command_log
    >>> model = RobotModel.from_yaml("examples/servo_arm/robot.yaml", estimates=False)
    >>> log = read_command_log("examples/servo_arm/moves.csv", model)
    >>> log.q.shape, log.time_step
    ((2000, 2), 0.008)
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
