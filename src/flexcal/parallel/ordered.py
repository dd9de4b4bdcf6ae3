"""Values of tasks in the order of the tasks, and their combination in a tree whose shape depends on their number alone."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from itertools import pairwise
from typing import Any, TypeVar

from flexcal.errors import FlexcalError
from flexcal.parallel.outcome import Outcome

V = TypeVar("V")


def value_of(outcome: Outcome[V]) -> V:
    """Value of a task; raises `FlexcalError` where it has an error instead."""
    if outcome.error is None:
        return outcome.value  # type: ignore[return-value]
    if outcome.error.code is not None:
        raise FlexcalError(outcome.error.code, outcome.error.sentence)
    raise FlexcalError(
        "E-WORK-007",
        f"a worker failed ({outcome.error.sentence}); see its log, or run without --on and with --jobs 1.",
    )


def values_in_order(outcomes: Generator[Outcome[V], None, None]) -> Iterator[V]:
    """Values of all outcomes by their index; the error of the first that has none is raised, and the iterator closed."""
    early: dict[int, Outcome[V]] = {}
    following = 0
    with closing(outcomes):  # at once: the garbage collector would, at any time, cancel what is left
        for outcome in outcomes:
            early[outcome.index] = outcome
            while following in early:
                yield value_of(early.pop(following))
                following += 1


def consecutive_groups(tasks: Sequence[V], most: int) -> list[Sequence[V]]:
    """At most `most` groups of about equal size of tasks that follow each other, none of them empty."""
    count = min(most, len(tasks))
    borders = [round(len(tasks) * number / count) for number in range(count + 1)]
    return [tasks[first:last] for first, last in pairwise(borders)]


def combined_groups(
    values: Iterator[V], groups: Sequence[Sequence[Any]], combine: Callable[[V, V], V]
) -> Iterator[V]:
    """Values, those of every group combined pair by pair: neighbours first, then their pairs, and so on.

    Of a group at most as many values are held as the tree is deep.
    """
    for group in groups:
        held: list[tuple[int, V]] = []  # the tasks behind each, a power of two
        for _, value in zip(group, values, strict=False):
            held.append((1, value))
            while len(held) > 1 and held[-1][0] == held[-2][0]:
                (count, left), (_, right) = held[-2:]
                held[-2:] = [(2 * count, combine(left, right))]
        total = held.pop()[1]
        while held:
            total = combine(held.pop()[1], total)
        yield total
