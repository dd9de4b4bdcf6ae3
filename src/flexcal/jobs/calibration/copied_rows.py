"""Rows that are copies of others: a reading is not repeated to its last digit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.error_model import group_numbers
from flexcal.data.poses import PoseSet, last_digit
from flexcal.report.layout import counted

_FINE = 2e-6
"""Last digit, m, up to which no two readings of an instrument have the same three coordinates by chance."""


def distinct_rows(poses: PoseSet) -> np.ndarray:
    """Mask (N,) without the rows that repeat joint positions, payload, temperature and the measured point of an earlier one.

    Points with few digits may be equal by chance; they count as copies where more than half of the repeated commands have them.
    """
    kept = np.ones(len(poses), bool)
    rows = np.flatnonzero(poses.located)
    labels = [np.unique(each[rows], return_inverse=True)[1] for each in (poses.target, poses.station)]
    numbers = [each[rows] for each in (poses.q, poses.payload, poses.temperature) if each is not None]
    command = np.column_stack([*numbers, *labels])
    reading = np.column_stack([command, poses.position[rows]])
    several = _occurs_again(reading)
    if not several.any():
        return kept
    first = np.unique(group_numbers(reading[several]), return_index=True)[1]
    copies = np.delete(rows[several], first)
    if last_digit(poses.position[rows]) > _FINE:
        commands = _occurs_again(command)
        repeated = commands.sum() - len(np.unique(_sum(command[commands])))
        if len(copies) <= repeated / 2:
            return kept
    kept[copies] = False
    return kept


def _sum(rows: np.ndarray) -> np.ndarray:
    """Weighted sum (N,) of each row, which equal rows have in common, and others do not but by chance; much faster to sort than rows."""
    weights = np.random.default_rng(0).uniform(1, 2, rows.shape[1])
    return sum(
        (weight * column for weight, column in zip(weights, rows.T, strict=True)), start=np.zeros(len(rows))
    )


def _occurs_again(rows: np.ndarray) -> np.ndarray:
    _, inverse, count = np.unique(_sum(rows), return_inverse=True, return_counts=True)
    return count[inverse] > 1


def without_copies(poses: PoseSet, kept: np.ndarray) -> PoseSet:
    """Poses of the rows `kept` (N,), with a note on the copies left out."""
    if kept.all():
        return poses
    copies = int((~kept).sum())
    which = "is a copy" if copies == 1 else "are copies"
    note = (
        f"left out: {counted(copies, 'row')} of {len(poses)}, which {which} of others, with the same joint positions and the same point to "
        "the last digit, as no second measurement has"
    )
    return replace(poses.subset(kept), notes=(*poses.notes, note))
