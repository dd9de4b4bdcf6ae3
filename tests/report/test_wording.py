"""Numbers, tables and the scale of the first screen."""

from __future__ import annotations

import math

import pytest

from flexcal.report.layout import (
    NOTHING,
    Check,
    ErrorRange,
    Table,
    millimetres,
    percent,
    ratio,
    significant,
    tally,
    worst,
)
from flexcal.report.layout.error_axis import place_ranges


def test_millimetres() -> None:
    assert [millimetres(v) for v in (7.1e-5, 5.824e-3, math.nan, None)] == ["0.071", "5.82", NOTHING, NOTHING]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (143.7, "143.7"),
        (0.99999999, "1.000"),
        (-0.5, "−0.5000"),
        (0.0, "0"),
        (1.5e-7, "1.500e−07"),
        (math.inf, NOTHING),
    ],
)
def test_significant(value: float, text: str) -> None:
    assert significant(value) == text


def test_percent_and_ratio() -> None:
    assert percent(-0.0123, signed=True) == "−1.2 %"
    assert ratio(5.0, 0.04) == "125 times"
    assert ratio(1.0, 0.0) == "many times"


def test_places_on_the_error_axis_are_logarithmic() -> None:
    ranges = (
        ErrorRange("a", 1e-5, 1e-4, 1e-3, "elastic"),
        ErrorRange("b", math.nan, 1e-3, 1e-2, "published"),
        ErrorRange("nothing", math.nan, math.nan, math.nan, "floor"),
    )
    steps = place_ranges(ranges).steps
    assert [s.error_range.label for s in steps] == ["a", "b"]
    a, b = steps
    assert a.mean is not None and a.p90 is not None and a.maximum is not None
    assert a.p90 - a.mean == pytest.approx(a.maximum - a.p90)
    assert b.mean is None and b.start == pytest.approx(a.maximum) and b.texts[0] == NOTHING
    assert all(0 <= place <= 100 for place, _ in place_ranges(ranges).ticks)
    assert all(s.start >= 0 and s.start + s.width <= 100 for s in steps)


def test_an_error_axis_without_numbers_is_empty() -> None:
    assert place_ranges((ErrorRange("a", math.nan, math.nan, math.nan, "floor"),)).steps == ()


def test_cells_span_what_belongs_to_them() -> None:
    table = Table("t", "caption", ("a", "b", "c", "d"), (("name", "not known", None, "x"),))
    assert table.cells == (((0, "name", 1), (1, "not known", 2), (3, "x", 1)),)


def test_the_worst_check_decides_and_the_unknown_does_not() -> None:
    good, care, unknown = (Check("q", "a", s) for s in ("good", "care", "unknown"))
    assert worst((good, unknown)) == "good"
    assert worst((good, care, unknown)) == "care"
    assert tally((good, care)) == "1 of 2 checks are good"
    assert tally((good, unknown)) == "1 of 2 checks are good, 1 cannot be judged"
