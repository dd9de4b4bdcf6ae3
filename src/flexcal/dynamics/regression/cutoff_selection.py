"""Selection of the low-pass cut-off by cross-validation of the predicted torques."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from flexcal.data.recordings import Decimation, Recording
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.signals import AT_REST, Motion, between_gaps
from flexcal.model.robot import RobotModel

BLOCKS = 10
_RATIO = 1.25
"""Ratio of neighbouring cut-offs; at first every other one is tried."""
_LOWEST_HZ = 1.0
_OVER = 5.0
"""Least ratio of the sampling rate to the largest cut-off tried."""
_ROWS_HZ = 100.0
"""Largest row rate, and largest cut-off in Hz: no robot's accelerations have signal above."""
_SPAN = 2.0
"""Longest extrapolation, s, of the motion at its ends."""
_ORDER = 4
_BORDER = 3
"""Rows at either end of a block that share samples with others."""
_FEWEST = 10
"""Least number of rows of a block without those."""
_MORE = 3.0
"""Least ratio of equations to unknowns."""
_SURE = 2.0
"""Gain in squared error, in standard errors over the blocks, required of another cut-off."""
_RISEN = 1.5
"""Ratio to the smallest squared error at which lower cut-offs are no longer tried."""
_ALIKE = 0.03
"""Relative rise of the squared error up to which a cut-off counts as equal, for the signs of velocities."""
_RANK = 1e-10


@dataclass(frozen=True, eq=False)
class ContinuousSamples:
    """Samples without gaps, every `time_step` (s): positions `q` (N, n) and `torque` (N, n) of motors plus external, N m.

    `payload` is kg, None where the log does not say.
    """

    time_step: float
    q: np.ndarray
    torque: np.ndarray
    payload: float | None


@dataclass(frozen=True)
class CutoffChoice:
    """Cut-off with the smallest prediction error in left-out blocks, Hz, and its relative error; `proposed_error` is that of the cut-off
    proposed from the spectrum.
    """

    cutoff_hz: float
    error: float
    proposed_error: float


def pieces(recordings: Iterable[Recording], samples: int, proposed_hz: float) -> Iterator[ContinuousSamples]:
    """First `samples` samples of a log between its gaps, at no less than the rate needed for cut-offs up to the proposed one."""
    left = samples
    for group in between_gaps(recordings):
        if left <= 0:
            return
        parts = list(_first(group, left))
        left -= sum(len(part) for part in parts)
        step = parts[0].time_step
        q = np.concatenate([part.q for part in parts])
        torque = np.concatenate([_net(part) for part in parts])
        thin = Decimation.near(1.0 / (step * _OVER * min(proposed_hz, _ROWS_HZ)))
        both = thin.apply(np.hstack([q, torque]).T).T
        if len(both):
            n = q.shape[1]
            payload = None if parts[0].payload is None else float(parts[0].payload[0])
            yield ContinuousSamples(step * thin.factor, both[:, :n], both[:, n:], payload)


def choose_cutoff(
    model: RobotModel, loads: Sequence[Sequence[ContinuousSamples]], proposed_hz: float
) -> CutoffChoice | None:
    """Best cut-off from the proposed one down, for classic friction; None for logs that are too short, or without need of a lower one.

    Every one of the `loads`, recordings with the same load, has parameters of its own. The rows are those of the proposed cut-off, at most
    100 a second, whichever is tried. Ten blocks of time are predicted from the others, every joint weighted by its error at the proposed
    cut-off. A lower one must save twice the standard error of the saving over the blocks, while the signs of friction are those of the
    proposed one: then q̈ is not signal up to there. Where it does, the signs are those of the highest cut-off within 3 % of the smallest
    squared error, signs included. With these the highest cut-off is taken whose squared error is within a standard error of the smallest
    one (Breiman et al. 1984): wrong signs beside reversals would hide what accelerations tell.
    """
    highest = min(proposed_hz, _ROWS_HZ)
    observation = Observation(model, CLASSIC)
    kept = np.array(sorted(BaseParameters.of(observation).identifiability.kept))
    tables = [_Tables(model, observation, kept, pieces, highest) for pieces in loads]
    tables = [table for table in tables if table.enough]
    if not tables:
        return None
    if not _Losses(tables, highest, signs_of=0).lower_is_better:
        return None
    own_signs = _Losses(tables, highest, signs_of=None)
    best = _Losses(tables, highest, signs_of=own_signs.highest_alike).highest_good
    if best == 0:
        return None
    size = sum(table.size for table in tables)
    errors = (math.sqrt(own_signs.total(number) / size) for number in (best, 0))
    return CutoffChoice(highest / _RATIO**best, *errors)


class _Losses:
    """Squared errors in left-out blocks, by the number of the cut-off: highest · 1.25^-number, Hz.

    Signs of velocities are those behind the cut-off with the number `signs_of`, or each one's own (None). Every other cut-off has been
    tried until errors had risen, and those beside the best one.
    """

    def __init__(self, tables: Sequence[_Tables], highest_hz: float, signs_of: int | None) -> None:
        self._tables, self._highest, self._signs_of = tables, highest_hz, signs_of
        self._losses: dict[int, np.ndarray] = {}
        number = 0
        while (
            self.total(number) <= _RISEN * self.total(self._lowest)
            and self._highest / _RATIO ** (number + 2) >= _LOWEST_HZ
        ):
            number += 2
        lowest = self._lowest
        for beside in (lowest - 1, lowest + 1):
            if beside > 0:
                self.blocks(beside)

    def blocks(self, number: int) -> np.ndarray:
        """Squared errors of all blocks of all tables (B,)."""
        if number not in self._losses:
            signs_of = number if self._signs_of is None else self._signs_of
            cutoff, signs = (self._highest / _RATIO**n for n in (number, signs_of))
            each = [table.losses(cutoff, signs) for table in self._tables]
            self._losses[number] = np.concatenate(each)
        return self._losses[number]

    def total(self, number: int) -> float:
        """Squared error of all blocks together."""
        return float(self.blocks(number).sum())

    @property
    def _lowest(self) -> int:
        self.blocks(0)
        return min(self._losses, key=self.total)

    @property
    def lower_is_better(self) -> bool:
        """Whether the best one gains more than twice the standard error of the gain."""
        saved = self.blocks(0) - self.blocks(self._lowest)
        return bool(saved.sum() > _SURE * _standard_error(saved))

    @property
    def highest_alike(self) -> int:
        """Number of the highest cut-off whose squared error is nearly the smallest."""
        most = (1 + _ALIKE) * self.total(self._lowest)
        return min(number for number in self._losses if self.total(number) <= most)

    @property
    def highest_good(self) -> int:
        """Number of the highest cut-off within a standard error of the best one."""
        lost = {number: blocks - self.blocks(self._lowest) for number, blocks in self._losses.items()}
        return min(number for number, more in lost.items() if more.sum() <= _standard_error(more))


def _standard_error(blocks: np.ndarray) -> float:
    """Standard error of the sum of blocks (B,)."""
    return float(blocks.std(ddof=1)) * math.sqrt(len(blocks))


class _Tables:
    """Rows of one log as sums of squares and products, block by block."""

    def __init__(
        self,
        model: RobotModel,
        observation: Observation,
        kept: np.ndarray,
        pieces: Sequence[ContinuousSamples],
        highest_hz: float,
    ) -> None:
        self._model, self._observation, self._kept = model, observation, kept
        self._filters = [_Filters(piece, highest_hz) for piece in pieces]
        self._sigma: np.ndarray | None = None
        self.size = 0.0
        rows = sum(f.rows for f in self._filters)
        self.enough = rows // BLOCKS >= 2 * _BORDER + _FEWEST and rows * model.n > _MORE * len(kept)

    def losses(self, cutoff_hz: float, signs_hz: float) -> np.ndarray:
        """Squared errors of the blocks (10,), each predicted from the others, over those of the joints at the first cut-off.

        The signs of velocities are those behind the cut-off `signs_hz`.
        """
        inner, whole = self._products(cutoff_hz, signs_hz)
        if self._sigma is None:
            missed = np.sum(self._missed(inner, whole, np.ones(self._model.n)), axis=0)
            self._sigma = np.sqrt(np.where(missed > 0, missed, 1.0))
            missed = np.sum(self._missed(inner, whole, self._sigma), axis=0)
            self._sigma = np.sqrt(np.where(missed > 0, missed, 1.0))
            self.size = float(np.sum(inner[:, :, -1, -1].sum(axis=0) / self._sigma**2))
        return np.sum(self._missed(inner, whole, self._sigma) / self._sigma**2, axis=1)

    def _missed(self, inner: np.ndarray, whole: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """Squared errors (10, n) of the blocks and joints."""
        weighted = np.einsum("bjkl,j->bkl", whole, 1.0 / sigma**2)
        total = weighted.sum(axis=0)
        errors = np.zeros(inner.shape[:2])
        for block, own in enumerate(weighted):
            train = total - own
            scale = 1.0 / np.sqrt(np.maximum(np.diag(train)[:-1], np.finfo(float).tiny))
            matrix = train[:-1, :-1] * np.outer(scale, scale)
            x = scale * np.linalg.lstsq(matrix, scale * train[:-1, -1], rcond=_RANK)[0]
            beside = np.append(-x, 1.0)
            errors[block] = np.einsum("k,jkl,l->j", beside, inner[block], beside)
        return errors

    def _products(self, cutoff_hz: float, signs_hz: float) -> tuple[np.ndarray, np.ndarray]:
        """Products [W, Y]ᵀ [W, Y] (10, n, p + 1, p + 1) of every block and joint: of its inner rows, and of all."""
        table = np.concatenate([self._rows(f, cutoff_hz, signs_hz) for f in self._filters], axis=1)
        edges = np.linspace(0, table.shape[1], BLOCKS + 1).astype(int)
        width = table.shape[2]
        inner, whole = np.zeros((2, BLOCKS, len(table), width, width))
        for block in range(BLOCKS):
            for joint, rows in enumerate(table[:, edges[block] : edges[block + 1]]):
                ends = np.concatenate([rows[:_BORDER], rows[-_BORDER:]])
                whole[block, joint] = rows.T @ rows
                inner[block, joint] = whole[block, joint] - ends.T @ ends
        return inner, whole

    def _rows(self, filters: _Filters, cutoff_hz: float, signs_hz: float) -> np.ndarray:
        """Rows [W, Y] (n, M, p + 1) of the base parameters; signs of velocities are taken before decimation."""
        motion = filters.motion(cutoff_hz)
        signs = filters.signs(signs_hz)
        names, kept = self._observation.names, self._kept
        table = np.zeros((self._model.n, len(motion), len(kept) + 1))
        columns = self._observation.columns(motion)
        for joint, (own, column_indices) in enumerate(
            zip(columns, self._observation.column_indices, strict=True)
        ):
            place = {number: row for row, number in enumerate(column_indices)}
            coulomb = f"{self._model.joint_names[joint]}.coulomb"
            for column, number in enumerate(kept):
                if number in place:
                    signed = names[number] == coulomb
                    table[joint, :, column] = signs[:, joint] if signed else own[place[number]]
        table[:, :, -1] = motion.torque.T
        return table


class _Filters:
    """Samples in the frequency domain, where low-pass, differences and decimation are products."""

    def __init__(self, piece: ContinuousSamples, highest_hz: float) -> None:
        from scipy.fft import next_fast_len

        self._step, count = piece.time_step, len(piece.q)
        self._factor = max(1, int(1.0 / (self._step * highest_hz)))
        self._beyond = min(count - 1, int(_SPAN / self._step))
        self._length = cast("int", next_fast_len(count + 2 * self._beyond, real=True))
        self._frequency = np.fft.rfftfreq(self._length, self._step)
        self._thin = _butterworth(self._frequency, self._step, 0.4 / (self._step * self._factor))
        self._lines = np.fft.rfft(self._continued(piece.q), axis=0)
        border = min(int(0.5 / self._step), count // 4)
        self._at = slice(self._beyond + border, self._beyond + count - border, self._factor)
        self._torque = self._thinned(np.fft.rfft(self._continued(piece.torque), axis=0))
        self.rows = len(self._torque)
        angle = 2 * np.pi * self._frequency * self._step
        slope = 1j * (8 * np.sin(angle) - np.sin(2 * angle)) / (6 * self._step)
        curvature = (16 * np.cos(angle) - np.cos(2 * angle) - 15) / (6 * self._step**2)
        self._differences = tuple(factor[:, None] for factor in (np.ones_like(angle), slope, curvature))

    def signs(self, cutoff_hz: float) -> np.ndarray:
        """Signs of the filtered velocities, decimated (M, n)."""
        speed = np.fft.irfft(self._passed(cutoff_hz) * self._differences[1], self._length, axis=0)
        signs = np.where(np.abs(speed) < AT_REST, 0.0, np.sign(speed))
        return self._thinned(np.fft.rfft(signs, axis=0))

    def motion(self, cutoff_hz: float) -> Motion:
        """Rows of the motion, filtered at `cutoff_hz` and decimated."""
        passed = self._passed(cutoff_hz)
        q, dq, ddq = (self._thinned(passed * factor) for factor in self._differences)
        time = self._step * self._factor * np.arange(len(q))
        return Motion(time, q, dq, ddq, self._torque)

    def _passed(self, cutoff_hz: float) -> np.ndarray:
        return self._lines * _butterworth(self._frequency, self._step, cutoff_hz)[:, None]

    def _thinned(self, lines: np.ndarray) -> np.ndarray:
        return np.fft.irfft(lines * self._thin[:, None], self._length, axis=0)[self._at]

    def _continued(self, values: np.ndarray) -> np.ndarray:
        """Signal continued by point reflection at its ends."""
        beyond = self._beyond
        before, after = 2 * values[0] - values[beyond:0:-1], 2 * values[-1] - values[-2 : -beyond - 2 : -1]
        rest = self._length - len(values) - 2 * beyond
        return np.concatenate([before, values, after, np.repeat(after[-1:], rest, axis=0)])


def _butterworth(frequency: np.ndarray, step: float, cutoff_hz: float) -> np.ndarray:
    """Response of `LowPass` to frequencies (F,), Hz; one where the cut-off is not below half the sampling rate."""
    if cutoff_hz >= 0.5 / step:
        return np.ones_like(frequency)
    corner = math.tan(math.pi * cutoff_hz * step)
    with np.errstate(over="ignore"):
        angle = np.tan(np.pi * np.minimum(frequency * step, 0.5))
        return 1.0 / (1.0 + (angle / corner) ** (2 * _ORDER))


def _first(recordings: Iterable[Recording], samples: int) -> Iterator[Recording]:
    for recording in recordings:
        if samples <= 0:
            return
        yield recording
        samples -= len(recording)


def _net(recording: Recording) -> np.ndarray:
    outside = recording.external_torque
    return recording.torque if outside is None else recording.torque + outside
