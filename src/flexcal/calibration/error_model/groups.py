"""Groups of readings with a common error: visits to a pose, regions of the workspace, sections in time, commands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model.folds import order_folds, workspace_folds
from flexcal.data.poses import PoseSet

COMMAND = "command"
"""Name of the model error common to all visits of a command."""
_CELL_VISITS, _MOST_CELLS, _FEWEST_CELLS = 5, 16, 4
"""Visits per block of the model error, and bounds on the number of blocks."""
SAME_COMMAND = 1e-4
"""Difference of joint positions (rad or m) below which they are one command."""
_FEWEST_REPEATED = 5
"""Least number of repeatedly visited commands for a variance between commands."""


@dataclass(frozen=True, eq=False)
class ErrorGroups:
    """Labels (R,) of readings that share an error, integers from 0.

    `pose`: measured in one visit to a pose, each another target or its orientation; the robot's scatter is common to them. The others
    share a model error of their points: a cell of the `workspace`, a stretch of the measuring `order`, a `command` with its target, -1
    for an orientation, and for what has no cell; None where there are too few poses, or too few commands that were visited again.
    """

    pose: np.ndarray
    workspace: np.ndarray | None = None
    order: np.ndarray | None = None
    command: np.ndarray | None = None

    @classmethod
    def of(cls, poses: PoseSet) -> ErrorGroups:
        """Groups by visit: rows of one pose number are a visit; a target that the visit already has begins another."""
        points = cls._of_points(poses)
        if not poses.present.any():
            points = cls(points.pose)
        turned = poses.angled
        if not turned.any():
            return points
        alone = np.full(int(turned.sum()), -1)
        blocks = {name: np.concatenate([labels, alone]) for name, labels in points.blocks.items()}
        return cls(np.concatenate([points.pose, points.pose[turned]]), **blocks)

    @classmethod
    def _of_points(cls, poses: PoseSet) -> ErrorGroups:
        _, target = np.unique(poses.target, return_inverse=True)
        visit = group_numbers(np.column_stack([poses.pose, occurrence(group_numbers(poses.pose, target))]))
        commands = group_numbers(np.column_stack([np.round(poses.q / SAME_COMMAND), target]))
        repeated = int((np.bincount(commands) > 1).sum())
        command = commands if repeated >= _FEWEST_REPEATED else None
        size = np.bincount(visit)
        count = min(len(size) // _CELL_VISITS, _MOST_CELLS)
        if count < _FEWEST_CELLS:
            return cls(visit, command=command)
        return cls(visit, _regions(poses, visit, count), order_folds(len(size), count)[visit], command)

    def subset(self, rows: np.ndarray) -> ErrorGroups:
        """Groups of the rows with these indices or of this mask."""
        blocks = {name: _numbered_again(labels[rows]) for name, labels in self.blocks.items()}
        return ErrorGroups(group_numbers(self.pose[rows]), **blocks)

    @property
    def blocks(self) -> dict[str, np.ndarray]:
        """Labels (N,) of the blocks of a common model error, by name."""
        named = {"workspace": self.workspace, "order": self.order, COMMAND: self.command}
        return {name: labels for name, labels in named.items() if labels is not None}

    @cached_property
    def visits(self) -> np.ndarray:
        """Rows (G, T) of every visit to a pose, in measuring order; -1 where it has fewer than T."""
        place = occurrence(self.pose)
        result = np.full((self.pose.max() + 1, place.max() + 1), -1)
        result[self.pose, place] = np.arange(len(self.pose))
        return result

    def gathered(self, rows: np.ndarray) -> np.ndarray:
        """Values (N, 3, …) of all points by visits, (G, 3 T, …); zero for points that a visit lacks."""
        by_visit = rows[self.visits]
        by_visit[self.visits < 0] = 0.0
        return by_visit.reshape(len(by_visit), -1, *rows.shape[2:])


def _numbered_again(labels: np.ndarray) -> np.ndarray:
    """Labels (R,) as numbers from 0 without gaps; negative ones stay -1."""
    known = labels >= 0
    result = np.full(len(labels), -1)
    if known.any():
        result[known] = group_numbers(labels[known])
    return result


def _regions(poses: PoseSet, visit: np.ndarray, count: int) -> np.ndarray | None:
    """Labels (N,) of `count` cells of the workspace, of whole visits (N,), for points of an instrument; None where there are none.

    Points in sockets have none, -1: an error common to those at one place of the fixture is taken for where it stands. Nor have distances
    and touches, whose directions differ. What is left of it is part of their own scatter.
    """
    measured = poses.located
    if not measured.any():
        return None
    labels = group_numbers(visit[measured])
    size = np.bincount(labels)
    place = np.column_stack([np.bincount(labels, axis) for axis in poses.position[measured].T])
    result = np.full(len(poses), -1)
    result[measured] = workspace_folds(place / size[:, None], count)[labels]
    return _numbered_again(result)


def block_columns(labels: np.ndarray) -> np.ndarray:
    """Columns (N, 3, 3 K) of an error common to each of K blocks."""
    rows = (labels[:, None] == np.unique(labels)[None]).astype(float)
    return np.kron(rows, np.eye(3)).reshape(len(labels), 3, -1)


def group_numbers(*columns: np.ndarray) -> np.ndarray:
    """Numbers (N,) from 0 of the distinct rows, in the order in which they first appear."""
    _, first, inverse = np.unique(np.column_stack(columns), axis=0, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse.ravel()]


def occurrence(labels: np.ndarray) -> np.ndarray:
    """Number of earlier rows (N,) with the same label."""
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=labels[order][0] - 1))
    counts = np.diff(np.append(starts, len(labels)))
    result = np.empty(len(labels), dtype=int)
    result[order] = np.arange(len(labels)) - np.repeat(starts, counts)
    return result
