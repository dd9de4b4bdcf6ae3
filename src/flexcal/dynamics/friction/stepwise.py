"""Selection of friction terms: forward selection by cross-validation and significance."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.inverse_model import Column, DriveTerm, Memory, Observation
from flexcal.dynamics.regression import Fold, prediction_errors
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel

_WORTH = 0.01
"""Least relative reduction of the error for a term to be added."""
_LEVEL = 0.05
"""Significance level of the best out of all candidates."""


@dataclass(frozen=True)
class Candidate:
    """Friction term of robot.yaml in one `shape` (empty for a term that has none)."""

    name: str
    shape: str
    term: DriveTerm

    @property
    def label(self) -> str:
        """Printed name of the candidate."""
        return f"{self.name} ({self.shape})" if self.shape else self.name

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """Columns of the term, with the shape in their names, so that several shapes can coexist."""
        for column in self.term.columns(model, motion, memory):
            yield replace(column, name=self.column(column.name))

    def column(self, name: str) -> str:
        """Name of the term's column `name` among those of several shapes."""
        return f"{name} {self.shape}"


@dataclass(frozen=True)
class SelectionStep:
    """A set of friction terms beyond the classic ones, and its cross-validation error ‖Y - W χ‖ / ‖Y‖.

    `p_value` is that of the last of the terms, times the number of candidates; None where the error alone decided.
    """

    terms: tuple[str, ...]
    error: float
    p_value: float | None = None


@dataclass(frozen=True)
class FrictionChoice:
    """Chosen candidates, and all trials, in order."""

    chosen: tuple[Candidate, ...]
    trials: tuple[SelectionStep, ...]

    @property
    def rivals(self) -> tuple[tuple[str, ...], ...]:
        """Labels of other terms of equal predictive power: as many with an error larger by less than a hundredth, or one more with a
        smaller error, which is not significant or saves less than a hundredth.
        """
        labels = tuple(candidate.label for candidate in self.chosen)
        (error,) = (trial.error for trial in self.trials if trial.terms == labels)
        most = {len(labels): (1 + _WORTH) * error, len(labels) + 1: error}
        return tuple(
            trial.terms
            for trial in self.trials
            if set(trial.terms) != set(labels) and trial.error < most.get(len(trial.terms), 0.0)
        )


def forward_selection(
    folds: Sequence[Fold],
    plain: Sequence[int],
    groups: Mapping[Candidate, Sequence[int]],
    p_value: Callable[[Sequence[int], Sequence[int]], float],
) -> FrictionChoice:
    """Add the significant candidate that lowers the error most, one after the other, while it falls by a hundredth of itself.

    `plain` are the numbers of the columns that are always in, `groups` those of each candidate. `p_value` is that of the columns of a
    candidate beside those of the terms before it; times the number of candidates it must be 0.05 at most (Bonferroni). Cross-validation
    alone takes a false term in up to a half of recordings whose noise remembers itself.
    """
    chosen: list[Candidate] = []
    (error,) = prediction_errors(folds, plain, [[]])
    trials = [SelectionStep((), error)]
    while left := [c for c in groups if c.name not in {taken.name for taken in chosen}]:
        before = [number for candidate in chosen for number in groups[candidate]]
        _, tried = _best(folds, plain, groups, chosen, left)
        taken = None
        for number in np.argsort([t.error for t in tried]):
            if taken is not None or tried[number].error > (1 - _WORTH) * error:
                break
            probability = min(1.0, len(groups) * p_value(before, groups[left[number]]))
            tried[number] = replace(tried[number], p_value=probability)
            taken = number if probability <= _LEVEL else None
        trials += tried
        if taken is None:
            break
        chosen.append(left[taken])
        error = tried[taken].error
    return FrictionChoice(tuple(chosen), tuple(trials))


def best_shapes(
    folds: Sequence[Fold],
    plain: Sequence[int],
    groups: Mapping[Candidate, Sequence[int]],
    names: Sequence[str],
) -> FrictionChoice:
    """Terms `names`, each in the shape with the smallest error, chosen one after the other."""
    chosen: list[Candidate] = []
    trials: list[SelectionStep] = []
    for name in names:
        best, tried = _best(folds, plain, groups, chosen, [c for c in groups if c.name == name])
        trials += tried
        chosen.append(best)
    return FrictionChoice(tuple(chosen), tuple(trials))


def _best(
    folds: Sequence[Fold],
    plain: Sequence[int],
    groups: Mapping[Candidate, Sequence[int]],
    chosen: Sequence[Candidate],
    left: Sequence[Candidate],
) -> tuple[Candidate, list[SelectionStep]]:
    fixed = [*plain, *(number for candidate in chosen for number in groups[candidate])]
    errors = prediction_errors(folds, fixed, [groups[candidate] for candidate in left])
    before = tuple(candidate.label for candidate in chosen)
    tried = [SelectionStep((*before, c.label), error) for c, error in zip(left, errors, strict=True)]
    return left[errors.index(min(errors))], tried


def candidate_columns(observation: Observation, candidate: Candidate) -> list[int]:
    """Column numbers of a candidate in an observation that has it among its terms."""
    own = Observation(observation.model, (candidate,)).names
    return [observation.names.index(name) for name in own if name.endswith(candidate.column(""))]
