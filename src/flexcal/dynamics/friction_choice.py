"""Selection of friction terms: forward selection by cross-validation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from flexcal.dynamics.cross_validation import Fold, prediction_errors
from flexcal.dynamics.drive_terms import Column, DriveTerm, Memory
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.observation import Observation
from flexcal.model import RobotModel

_WORTH = 0.01
"""A term is worth its parameters if the error falls by this share of itself."""


@dataclass(frozen=True)
class Candidate:
    """A friction term of robot.yaml in one `shape` (empty for a term that has none)."""

    name: str
    shape: str
    term: DriveTerm

    @property
    def label(self) -> str:
        """As it is printed."""
        return f"{self.name} ({self.shape})" if self.shape else self.name

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """Those of the term, named by the shape too, so that several shapes stand side by side."""
        for column in self.term.columns(model, motion, memory):
            yield replace(column, name=self.column(column.name))

    def column(self, name: str) -> str:
        """What the column `name` of the term is called here."""
        return f"{name} {self.shape}"


@dataclass(frozen=True)
class Trial:
    """A set of friction terms beyond the classic ones, and its cross-validation error ‖Y - W χ‖ / ‖Y‖."""

    terms: tuple[str, ...]
    error: float


@dataclass(frozen=True)
class FrictionChoice:
    """The candidates chosen, and everything that was tried, in order."""

    chosen: tuple[Candidate, ...]
    trials: tuple[Trial, ...]


def forward_selection(
    folds: Sequence[Fold], plain: Sequence[int], groups: Mapping[Candidate, Sequence[int]]
) -> FrictionChoice:
    """Adds the candidate that lowers the error most, one term after the other, while it falls by a hundredth of itself.

    `plain` are the numbers of the columns that are always in, `groups` those of each candidate.
    """
    chosen: list[Candidate] = []
    (error,) = prediction_errors(folds, plain, [[]])
    trials = [Trial((), error)]
    while left := [c for c in groups if c.name not in {taken.name for taken in chosen}]:
        found, tried = _best(folds, plain, groups, chosen, left)
        trials += tried
        if min(t.error for t in tried) > (1 - _WORTH) * error:
            break
        chosen.append(found)
        error = min(t.error for t in tried)
    return FrictionChoice(tuple(chosen), tuple(trials))


def best_shapes(
    folds: Sequence[Fold],
    plain: Sequence[int],
    groups: Mapping[Candidate, Sequence[int]],
    names: Sequence[str],
) -> FrictionChoice:
    """The terms `names`, one after the other, each in the shape with the smallest error; all of them are taken."""
    chosen: list[Candidate] = []
    trials: list[Trial] = []
    for name in names:
        found, tried = _best(folds, plain, groups, chosen, [c for c in groups if c.name == name])
        trials += tried
        chosen.append(found)
    return FrictionChoice(tuple(chosen), tuple(trials))


def _best(
    folds: Sequence[Fold],
    plain: Sequence[int],
    groups: Mapping[Candidate, Sequence[int]],
    chosen: Sequence[Candidate],
    left: Sequence[Candidate],
) -> tuple[Candidate, list[Trial]]:
    fixed = [*plain, *(number for candidate in chosen for number in groups[candidate])]
    errors = prediction_errors(folds, fixed, [groups[candidate] for candidate in left])
    before = tuple(candidate.label for candidate in chosen)
    tried = [Trial((*before, c.label), error) for c, error in zip(left, errors, strict=True)]
    return left[errors.index(min(errors))], tried


def candidate_columns(observation: Observation, candidate: Candidate) -> list[int]:
    """Numbers of a candidate's columns in an observation that has it among its terms."""
    own = Observation(observation.model, (candidate,)).names
    return [observation.names.index(name) for name in own if name.endswith(candidate.column(""))]
