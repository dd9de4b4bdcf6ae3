"""A source of measured rows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from flexcal.jobs.guidance import Source
    from flexcal.studio.steps.measure.next_pose import NextPose
    from flexcal.studio.steps.measure.series import Series
    from flexcal.studio.window import Window


class Measuring(Protocol):
    """The measurement that rows come to."""

    @property
    def window(self) -> Window:
        """Where it is shown."""
        ...

    @property
    def series(self) -> Series:
        """Plan and rows now."""
        ...

    @property
    def following(self) -> NextPose | None:
        """The pose that is to be measured next; None where there is none, or it is not known yet."""
        ...

    @property
    def is_complete(self) -> bool:
        """Whether no pose is left to measure."""
        ...

    def take(self, rows: Sequence[Mapping[str, str]], source: Source | None = None) -> None:
        """Take rows, texts by column; raises `InputError` for those that do not fit."""
        ...


class RowSource(ABC):
    """Where rows come from.

    Parameters
    ----------
    measuring : Measuring
        What they come to.
    """

    title: ClassVar[str]

    def __init__(self, measuring: Measuring):
        self.measuring = measuring
        self.window = measuring.window

    @abstractmethod
    def add(self) -> None:
        """Add its elements at the current place of the GUI."""

    def tick(self) -> None:  # noqa: B027  nothing comes by itself
        """Take what has come; called some times a second."""

    def measure_next(self) -> None:  # noqa: B027  another program measures
        """Measure the next pose."""
