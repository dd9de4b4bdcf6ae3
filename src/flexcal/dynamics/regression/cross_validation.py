"""Cross-validation in blocks of time, from triangular factors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression.batches import ExperimentSystem, reduced
from flexcal.dynamics.regression.triangular_factor import TriangularFactor, widened
from flexcal.errors import FlexcalError

FOLDS = 10
_RANK = 1e-9
"""Singular value, for columns of unit length, below which it is zero."""
_NEW = 1e-6
"""Share of a column not explained by others, below which it adds nothing."""


@dataclass(frozen=True, eq=False)
class Fold:
    """Fold of cross-validation: `train` (·, p + 1) represents [W, Y] outside the block of that `number`, each joint by its own noise;
    `test` that of the block, in N m.
    """

    number: int
    train: np.ndarray
    test: np.ndarray


def folds(
    systems: Sequence[ExperimentSystem],
    column_indices: Sequence[np.ndarray],
    columns: int,
    weigh_by: Sequence[int],
    purge_rows: int,
) -> list[Fold]:
    """Consecutive blocks of about equal size; `purge_rows` on either side of a block are excluded from training when it is the test.

    `column_indices` are the numbers of every joint's columns among all `columns`. The noise of a joint is what its columns among `weigh_by`
    leave of its torques outside the block. Raises `FlexcalError` where no block leaves others to learn from.
    """
    pieces = _pieces(systems, purge_rows)
    result = []
    for fold in sorted({piece.fold for piece in pieces}):
        train = [p for p in pieces if not p.touches(fold)]
        test = [p for p in pieces if p.fold == fold]
        if train:
            own, other = [], []
            for joint, numbers in enumerate(column_indices):
                inside = reduced([p.factors[joint] for p in test])
                outside = reduced([p.factors[joint] for p in train])
                sigma = _noise(outside, sum(p.rows for p in train), np.isin(numbers, weigh_by))
                own.append(widened(inside, numbers, columns))
                other.append(widened(outside / sigma, numbers, columns))
            result.append(Fold(fold, reduced(other), reduced(own)))
    if not result:
        raise FlexcalError(
            "E-DYN-026",
            "the recordings are too short to choose friction by cross-validation; record for longer, or declare 'friction: classic'.",
        )
    return result


def prediction_errors(
    folds: Sequence[Fold], fixed: Sequence[int], groups: Sequence[Sequence[int]]
) -> list[float]:
    """Relative error ‖Y - W χ‖ / ‖Y‖ over the blocks, each predicted by the others, with the columns `fixed` and those of one of the
    `groups`.
    """
    missed, size = np.zeros(len(groups)), 0.0
    for fold in folds:
        norms = np.linalg.norm(fold.train, axis=0)
        scale = np.where(norms > 0, norms, 1.0)
        train, test = fold.train / scale, fold.test / scale
        solution = np.linalg.lstsq(train[:, fixed], train, rcond=_RANK)[0]
        train, test = train - train[:, fixed] @ solution, test - test[:, fixed] @ solution
        train[:, np.linalg.norm(train, axis=0) < _NEW] = 0.0
        for number, group in enumerate(groups):
            parameters = np.linalg.lstsq(train[:, group], train[:, -1], rcond=_RANK)[0]
            left = test[:, -1] - test[:, group] @ parameters
            missed[number] += (scale[-1] ** 2) * float(left @ left)
        size += float(fold.test[:, -1] @ fold.test[:, -1])
    return [math.sqrt(value / size) for value in missed]


def solutions(folds: Sequence[Fold], kept: Sequence[int], start: np.ndarray) -> list[np.ndarray]:
    """Least-squares parameters (p,) outside of every block; those that are not `kept`, and undetermined directions, stay as in `start`
    (p,).
    """
    parameters = []
    for fold in folds:
        train = fold.train[:, kept]
        norms = np.linalg.norm(train, axis=0)
        scale = np.where(norms > 0, norms, 1.0)
        left = fold.train[:, -1] - fold.train[:, :-1] @ start
        values = start.copy()
        values[kept] += np.linalg.lstsq(train / scale, left, rcond=_RANK)[0] / scale
        parameters.append(values)
    return parameters


def fold_numbers(systems: Sequence[ExperimentSystem]) -> list[dict[int, int]]:
    """Block number of each batch of every system, by the batch's number."""
    total = sum(batch.rows for system in systems for batch in system.batches)
    done, numbers = 0, []
    for system in systems:
        own = {}
        for batch in system.batches:
            own[batch.number] = min(FOLDS - 1, FOLDS * (done + batch.rows // 2) // total)
            done += batch.rows
        numbers.append(own)
    return numbers


@dataclass(frozen=True, eq=False)
class _Piece:
    """Rows of one fold with the same adjacency to the fold before or after, of the same recording."""

    fold: int
    near_before: bool
    near_after: bool
    rows: int
    factors: tuple[np.ndarray, ...]

    def touches(self, fold: int) -> bool:
        return (
            self.fold == fold
            or (self.near_before and self.fold == fold + 1)
            or (self.near_after and self.fold == fold - 1)
        )


def _pieces(systems: Sequence[ExperimentSystem], purge_rows: int) -> list[_Piece]:
    groups: dict[tuple[int, bool, bool], list] = {}
    for system, own in zip(systems, fold_numbers(systems), strict=True):
        numbered = [(own[batch.number], batch) for batch in system.batches]
        reach = -(-purge_rows // system.batch_rows)
        for fold, batch in numbered:
            near = {other for other, b in numbered if abs(b.number - batch.number) <= reach}
            groups.setdefault((fold, fold - 1 in near, fold + 1 in near), []).append(batch)
    return [
        _Piece(
            *key,
            sum(b.rows for b in batches),
            tuple(reduced([b.factors[j] for b in batches]) for j in range(len(batches[0].factors))),
        )
        for key, batches in groups.items()
    ]


def _noise(system: np.ndarray, rows: int, known: np.ndarray) -> float:
    sigma, _ = TriangularFactor.padded(reduced([system[:, np.append(known, True)]]), rows).noise()
    size = float(np.linalg.norm(system[:, -1])) / math.sqrt(rows)
    return sigma if sigma > 0 else size or 1.0
