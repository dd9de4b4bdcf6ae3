"""Numbers that an expanded description is to have, and the comparison with what it got."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.export.xacro_expansion import ExpandedElement

KEPT = 1e-13
"""Difference, m or rad, below which a number stays as it is written."""
EXACT = 1e-11
"""Difference, m or rad, between a number wanted and made."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """Numbers that an attribute of a child of `parent` is to have; `owner` is the joint or link whose they are, `key` their name there.

    The child is `element` or, None, a new one of the given `tag` and `fixed` attributes. Without an `attribute` the numbers are its text.
    """

    owner: ExpandedElement
    key: str
    parent: ExpandedElement
    element: ExpandedElement | None
    tag: str
    attribute: str | None
    values: tuple[float, ...]
    usual: tuple[float, ...]
    fixed: tuple[tuple[str, str], ...] = ()

    @property
    def text(self) -> str | None:
        """Numbers as expanded; None where they are not written."""
        if self.element is None:
            return None
        return self.element.text if self.attribute is None else self.element.attributes.get(self.attribute)

    @property
    def current(self) -> tuple[float, ...]:
        """Numbers as expanded, or the `usual` ones."""
        return self.usual if self.text is None else tuple(float(word) for word in self.text.split())

    @property
    def changed(self) -> bool:
        """Whether a number differs."""
        return any(abs(new - old) > KEPT for new, old in zip(self.values, self.current, strict=True))

    @property
    def name(self) -> str:
        """Name of the joint or link."""
        return self.owner.attributes["name"]


def require_wanted(
    path: Path, before: ExpandedElement, after: ExpandedElement, wanted: Sequence[Wanted]
) -> None:
    """Raise `FlexcalError` unless the description `after` has the wanted numbers and is otherwise as `before`."""
    numbers: dict[tuple[str, ...], dict[str | None, tuple[float, ...]]] = {}
    given, made = _by_path(before), _by_path(after)
    places = {id(element): place for place, element in given.items()}
    for item in wanted:
        if item.changed:
            own = (*places[id(item.parent)], f"{item.tag} {dict(item.fixed).get('name', '')} 0")
            place = own if item.element is None else places[id(item.element)]
            numbers.setdefault(place, {})[item.attribute] = item.values
    for place in dict.fromkeys([*given, *made, *numbers]):
        if not _is_as_wanted(given.get(place), made.get(place), numbers.get(place, {})):
            named = " in ".join(" ".join(part.split()[:-1]) for part in reversed(place[1:]))
            raise FlexcalError(
                "E-ROS-010",
                f"{path}: <{named}> would not get the numbers wanted, so nothing is written; export urdf instead.",
            )


def _is_as_wanted(
    given: ExpandedElement | None,
    made: ExpandedElement | None,
    numbers: dict[str | None, tuple[float, ...]],
) -> bool:
    if made is None or (given is None and not numbers):
        return False
    for attribute in {*({} if given is None else given.attributes), *made.attributes, None}:
        new = made.text if attribute is None else made.attributes.get(attribute)
        if attribute in numbers:
            words = (new or "").split()
            if len(words) != len(numbers[attribute]) or not all(
                is_number(word) and abs(float(word) - value) <= EXACT
                for word, value in zip(words, numbers[attribute], strict=True)
            ):
                return False
        elif given is not None and new != (
            given.text if attribute is None else given.attributes.get(attribute)
        ):
            return False
    return True


def _by_path(root: ExpandedElement) -> dict[tuple[str, ...], ExpandedElement]:
    """Elements by the tags and names from the root, with a number where siblings share both."""
    found: dict[tuple[str, ...], ExpandedElement] = {}
    waiting: list[tuple[tuple[str, ...], ExpandedElement]] = [((root.tag,), root)]
    while waiting:
        path, element = waiting.pop()
        found[path] = element
        count: dict[str, int] = {}
        for child in element.children:
            name = f"{child.tag} {child.attributes.get('name', '')}"
            waiting.append(((*path, f"{name} {count.get(name, 0)}"), child))
            count[name] = count.get(name, 0) + 1
    return found


def same_numbers(one: Sequence[float], other: Sequence[float]) -> bool:
    """Whether two rows of numbers differ by rounding at most."""
    return all(abs(a - b) <= KEPT for a, b in zip(one, other, strict=True))


def is_number(word: str) -> bool:
    """Whether a word is a finite number."""
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def number_text(value: float) -> str:
    """A number that XML, Python and YAML read alike."""
    text = repr(float(value) + 0.0)
    mantissa, exponent, power = text.partition("e")
    return f"{mantissa}.0e{power}" if exponent and "." not in mantissa else text
