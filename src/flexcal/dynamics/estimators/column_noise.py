"""Errors of the observation matrix due to position noise, from a second pass with added noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.regression import (
    Batch,
    ExperimentSystem,
    RegressionBlock,
    RegressionData,
    reduced,
    regression_blocks,
)
from flexcal.dynamics.signals import Experiment, JointLog, Motion, filtered_motion, log_blocks
from flexcal.errors import FlexcalError
from flexcal.model.robot import FRICTION_PARAMETERS, RobotModel, unit_of

_EXACT = (
    "coulomb",
    "torque_offset",
    *(key for key in FRICTION_PARAMETERS if unit_of(key) in ("N m", "1")),
)
"""Prefixes of names of columns that are constants or signs of a velocity, free of errors except at reversals. A friction term among them
has a column that is a number, or a torque of the links: its parameter is a torque, or a number.

Of a friction term these are the ones whose column is a number, or a torque of the links: its parameter is a torque, or a number.
"""
_ORDER = 4
_GAIN = 70.0
"""Ratio of the variance of the fourth difference of white noise to its own."""
_SEED = 1994


def regressor_errors(recorded: RecordedRows, noisy: Sequence[Experiment]) -> RegressionData:
    """Rows of W with the noise of the experiments `noisy`, less those of the recorded ones; zero in Y, signs and constants.

    Of either, one pass. Each of the noisy experiments has the samples of its recorded one, and errors of the same size on top of its own.
    """
    observation = recorded.observation
    exact = np.array([name.rpartition(".")[2].startswith(_EXACT) for name in observation.names])
    systems = []
    for experiment, other, window in zip(recorded.experiments, noisy, recorded.windows, strict=True):
        passes = (
            regression_blocks(observation, each, recorded.decimation, window) for each in (experiment, other)
        )
        tables = [np.zeros((0, width)) for width in observation.widths]
        count = 0
        for block, spoilt in zip(*passes, strict=True):
            keep = ~block.still if recorded.mask_standstill else np.ones(len(block), dtype=bool)
            count += int(keep.sum())
            parts = _difference(block.where(keep), spoilt.where(keep))
            tables = [reduced([h, part.T]) for h, part in zip(tables, parts, strict=True)]
        whole = []
        for table, projection, column_indices in zip(
            tables, observation.projection, observation.column_indices, strict=True
        ):
            whole.append(np.column_stack([table[:, :-1] @ projection, table[:, -1]]))
            whole[-1][:, :-1][:, exact[column_indices]] = 0.0
        systems.append(ExperimentSystem((Batch(0, count, tuple(whole)),), count, 0.0, 0))
    return RegressionData.of(observation, recorded.base, systems)


def _difference(block: RegressionBlock, spoilt: RegressionBlock) -> Iterable[np.ndarray]:
    for own, other in zip(block.reduced, spoilt.reduced, strict=True):
        yield np.vstack([other[:-1] - own[:-1], np.zeros_like(own[-1:])])


def perturbed_logs(recorded: RecordedRows) -> list[PerturbedLog]:
    """Recorded logs with their own position noise added once more; raises `FlexcalError` for an experiment that is no log."""
    model = recorded.observation.model
    logs = [experiment for experiment in recorded.experiments if isinstance(experiment, JointLog)]
    if len(logs) < len(recorded.experiments):
        raise FlexcalError(
            "E-DYN-004", "total least squares needs the positions as they were logged, with their noise."
        )
    return [
        PerturbedLog(log, model, position_noise(log, model), _SEED + number)
        for number, log in enumerate(logs)
    ]


def position_noise(log: JointLog, model: RobotModel) -> np.ndarray:
    """Standard deviation (n,) of white noise in the logged positions, rad or m, by fourth differences, which contain no motion."""
    squares, count = np.zeros(model.n), 0
    for recording in log_blocks(log.path, model):
        rest = np.diff(recording.q, _ORDER, axis=0)
        squares += np.sum(rest**2, axis=0)
        count += len(rest)
    return np.sqrt(squares / (_GAIN * max(1, count)))


@dataclass(frozen=True, eq=False)
class PerturbedLog:
    """Log with added white position noise of standard deviations `std` (n,), identical in every pass."""

    log: JointLog
    model: RobotModel
    std: np.ndarray
    seed: int

    @property
    def name(self) -> str:
        return self.log.name

    @property
    def samples(self) -> int:
        return self.log.samples

    @property
    def top_speed(self) -> np.ndarray:
        return self.log.top_speed

    @property
    def cutoff_hz(self) -> float:
        return self.log.cutoff_hz

    def blocks(self) -> Iterator[Motion]:
        rng = np.random.default_rng(self.seed)
        recordings = log_blocks(self.log.path, self.model)
        noisy = (replace(r, q=r.q + self.std * rng.normal(size=r.q.shape)) for r in recordings)
        motions = filtered_motion(noisy, self.log.cutoff_hz, self.model.config.dynamics.torque)
        return map(self.log.settled, motions)
