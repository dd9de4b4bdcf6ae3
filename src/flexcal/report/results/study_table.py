"""Rows of a study as columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import polars

_ESTIMATE = ".estimate"


@dataclass(frozen=True, eq=False)
class StudyTable:
    """Tasks of a study that have ended: their columns as stored, and what the study declares of them.

    `options` are the columns of the options that differ between tasks; `error` names the errors that are the result of a task; `units` are
    SI units of parameters, by name.
    """

    frame: polars.DataFrame
    options: Sequence[str]
    error: str
    has_truth: bool
    units: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, frame: polars.DataFrame, document: Mapping[str, Any]) -> StudyTable:
        """The rows of the study that a results.json tells of."""
        units = document.get("units", {})
        return cls(frame, document["options"], document["error"], document["has_truth"], units)

    def __len__(self) -> int:
        return len(self.frame)

    def numbers(self, name: str) -> np.ndarray:
        """A column (N,) as numbers; NaN where a task has none."""
        import polars

        if name not in self.frame.columns:
            return np.full(len(self.frame), np.nan)
        return self.frame[name].cast(polars.Float64, strict=False).fill_null(np.nan).to_numpy()

    def values(self, name: str) -> list[Any]:
        """A column as it is."""
        return self.frame[name].to_list() if name in self.frame.columns else [None] * len(self.frame)

    @cached_property
    def drawn_together(self) -> tuple[str, ...]:
        """Options of which not every value runs with every combination of the others."""
        whole = self._count(self.options)
        found = []
        for name in self.options:
            others = [other for other in self.options if other != name]
            if whole < self._count((name,)) * self._count(others):
                found.append(name)
        return tuple(found)

    def combinations(self, names: Sequence[str]) -> np.ndarray:
        """Number (N,) of the combination of values of several columns in every row."""
        numbers: dict[Any, int] = {}
        rows = zip(*(self.values(name) for name in names), strict=True) if names else [()] * len(self)
        return np.array([numbers.setdefault(row, len(numbers)) for row in rows], dtype=int)

    def _count(self, names: Sequence[str]) -> int:
        return len(np.unique(self.combinations(names)))

    @property
    def errors(self) -> tuple[str, ...]:
        """Kinds of errors that the tasks have, in mm."""
        return tuple(name.removesuffix(".p90_mm") for name in self.frame.columns if name.endswith(".p90_mm"))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that some task has estimated."""
        return tuple(name.removesuffix(_ESTIMATE) for name in self.frame.columns if name.endswith(_ESTIMATE))
