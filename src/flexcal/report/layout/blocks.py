"""Content of a report page, before it becomes HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from flexcal.report.layout.figure import Figure

Status = Literal["good", "care", "bad", "unknown"]
"""A judgement; "unknown" where the data do not allow one, which counts neither way."""


@dataclass(frozen=True)
class Check:
    """One question about trust, its answer in a sentence, and whether that is good news.

    `code` names it in results.json; an `independent` check compares with data that the fit did not use.
    """

    question: str
    answer: str
    status: Status
    code: str = ""
    independent: bool = False

    def named(self, code: str, *, independent: bool = False) -> Check:
        """The same check with its code."""
        return replace(self, code=code, independent=independent)


@dataclass(frozen=True)
class Fact:
    """One of the three questions of the first screen, answered by a number; `status` colours only a judgement."""

    question: str
    value: str
    unit: str
    detail: str
    status: Status | None = None


@dataclass(frozen=True)
class ErrorRange:
    """A range of errors on the first screen's scale: mean, 90th percentile and maximum in metres (nan where unknown)."""

    label: str
    mean: float
    p90: float
    maximum: float
    kind: Literal["nominal", "rigid", "elastic", "floor", "published"]


@dataclass(frozen=True)
class Verdict:
    """The first screen."""

    status: Status
    headline: str
    sentence: str
    facts: tuple[Fact, ...]
    error_ranges: tuple[ErrorRange, ...]
    error_ranges_caption: str
    checks: tuple[Check, ...]

    @property
    def tally(self) -> str:
        """Number of good checks, in words; the comparison with a simulation's truth does not count."""
        return tally([check for check in self.checks if check.code != TRUTH])


@dataclass(frozen=True)
class Table:
    """A table; the first cell of a row names it, and a cell that is None belongs to the one before it.

    `text_columns` are the numbers of columns that hold words, `strong` of the rows that matter most; `folded` hides the table behind
    its caption until asked for.
    """

    id: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str | None, ...], ...]
    note: str = ""
    text_columns: tuple[int, ...] = ()
    strong: tuple[int, ...] = ()
    folded: bool = False
    kind: Literal["table"] = "table"

    @property
    def cells(self) -> tuple[tuple[tuple[int, str, int], ...], ...]:
        """Rows of (column, text, columns spanned)."""
        result = []
        for row in self.rows:
            cells: list[tuple[int, str, int]] = []
            for column, text in enumerate(row):
                if text is None:
                    first, before, span = cells.pop()
                    cells.append((first, before, span + 1))
                else:
                    cells.append((column, text, 1))
            result.append(tuple(cells))
        return tuple(result)


@dataclass(frozen=True)
class Selector:
    """A choice of which traces a figure shows: those whose `meta[key]` is the chosen option, or that have no such key."""

    label: str
    key: str
    options: tuple[str, ...]


@dataclass(frozen=True)
class Slider:
    """Slider for the magnification of vectors in traces whose `meta` has the `exaggeration` they come with.

    `factors` are the choices; every option of the selector `key` has its own, `start` at first.
    """

    label: str
    key: str
    factors: tuple[float, ...]
    start: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class FigureBlock:
    """A figure with what a reader needs: title, how to read it, and a description for those who cannot see it."""

    id: str
    title: str
    figure: Figure
    caption: str
    description: str
    selectors: tuple[Selector, ...] = ()
    slider: Slider | None = None
    kind: Literal["figure"] = "figure"


@dataclass(frozen=True)
class Text:
    """Paragraphs, and points beneath them, with a heading of their own where there is one."""

    paragraphs: tuple[str, ...]
    title: str = ""
    points: tuple[str, ...] = ()
    kind: Literal["text"] = "text"


Block = Table | FigureBlock | Text


@dataclass(frozen=True)
class Section:
    """A part of the report under one heading."""

    id: str
    title: str
    lead: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """A whole report; `document` is embedded for machines."""

    title: str
    subtitle: str
    verdict: Verdict
    sections: Sequence[Section]
    document: Mapping[str, Any] = field(default_factory=dict)

    @property
    def figures(self) -> tuple[FigureBlock, ...]:
        """All figures in the order of the page."""
        return tuple(b for s in self.sections for b in s.blocks if isinstance(b, FigureBlock))

    @property
    def numbers(self) -> dict[str, int]:
        """Number of each figure by its id, in the order of the page."""
        return {block.id: number for number, block in enumerate(self.figures, start=1)}


TRUTH = "truth"
"""Code of the comparison with the truth that a simulation knows."""


def tally(checks: Sequence[Check]) -> str:
    """Number of good checks, and of undecidable ones, in words."""
    good, unknown = (sum(check.status == status for check in checks) for status in ("good", "unknown"))
    words = f"{good} of {len(checks)} checks are good"
    return f"{words}, {unknown} cannot be judged" if unknown else words


def worst(checks: Sequence[Check]) -> Status:
    """Status of the worst check; undecidable ones do not count."""
    for status in ("bad", "care"):
        if any(check.status == status for check in checks):
            return status
    return "good"
