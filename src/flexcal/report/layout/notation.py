"""Formatting of numbers and names."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.estimation import Estimate
from flexcal.units import MILLIMETRE

NOTHING = "–"
"""Placeholder for a missing number."""

_SCALED = {
    "m": (1e3, "mm"),
    "rad": (1e3, "mrad"),
    "N m/rad": (1e-3, "kN m/rad"),
    "N m s/rad": (1.0, "N m s/rad"),
    "rad/(N m)": (1e6, "µrad/(N m)"),
    "1/K": (1e6, "µm/m/K"),
    "rad/K": (1e6, "µrad/K"),
    "m/K": (1e6, "µm/K"),
}


def millimetres(value: float | None) -> str:
    """A length (m) in millimetres: micrometre digits below 1 mm, 10 µm above; a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return NOTHING
    size = value / MILLIMETRE
    return f"{size:.3f}" if abs(size) < 1 else f"{size:.2f}"


def document_millimetres(value: float | None) -> str:
    """A length that a document has in millimetres, as `millimetres` writes it."""
    return millimetres(None if value is None else value * MILLIMETRE)


def statistics_cells(statistics: ErrorStatistics | None) -> tuple[str, str, str]:
    """Mean, 90th percentile and maximum in millimetres, dashes where unknown."""
    if statistics is None:
        return (NOTHING, NOTHING, NOTHING)
    return (millimetres(statistics.mean), millimetres(statistics.p90), millimetres(statistics.max))


def counted(number: int, noun: str) -> str:
    """A number of things, the `noun` in the plural where it is not one."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def listed(names: Sequence[str], most: int) -> str:
    """Names with commas between; of more than `most` the first so many, and how many more."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"


def scaled(unit: str) -> tuple[float, str]:
    """Factor and unit in which an SI value is printed."""
    return _SCALED.get(unit, (1.0, unit))


def significant(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits, without exponents between 1e-3 and 1e5."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    magnitude = int(f"{value:.{digits - 1}e}".rpartition("e")[2])
    if not -4 < magnitude < 5:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    return f"{value:.{max(0, digits - 1 - magnitude)}f}".replace("-", "−")


def interval_words(estimate: Estimate, name: str, written: Callable[[float], str]) -> str:
    """95 % interval of a parameter, its limits as `written`: one limit where the other is a bound, a dash where there is none."""
    interval = estimate.interval(name)
    if interval is None:
        return NOTHING
    low, high = map(written, interval)
    return {"lower": f"at most {high}", "upper": f"at least {low}"}.get(
        estimate.bound(name) or "", f"{low} to {high}"
    )


def to_half_width(value: float, half_width: float, digits: int = 2) -> str:
    """Number rounded to `digits` significant digits of the half width of its interval."""
    if not half_width > 0:
        return significant(value)
    decimals = max(0, digits - 1 - int(f"{half_width:.{digits - 1}e}".rpartition("e")[2]))
    return f"{value:z.{decimals}f}".replace("-", "−")


def percent(value: float | None, *, signed: bool = False) -> str:
    """A ratio in percent with two significant digits."""
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{100 * value:+.1f}" if signed else f"{100 * value:.1f}"
    return f"{text} %".replace("-", "−")


def spring_label(name: str) -> str:
    """`joint_1.bearing_x.stiffness` → "joint_1 bearing x"."""
    owner, spring, _ = name.rsplit(".", 2)
    return f"{owner} {spring.replace('_', ' ')}"


def ratio(worse: float, better: float) -> str:
    """Factor of reduction, in words for a sentence: "31 times"."""
    if not better > 0:
        return "many times"
    times = worse / better
    return f"{times:.0f} times" if times >= 10 else f"{times:.1f} times"


def sentences(remarks: Sequence[str]) -> tuple[str, ...]:
    """Remarks of the terminal as sentences: with a capital and a full stop."""
    return tuple(f"{remark[:1].upper()}{remark[1:]}." for remark in remarks)


def p_value(value: float) -> str:
    """A p-value with two decimals, or one significant digit below 0.1."""
    if value < 0.001:
        return "0.001 or less"
    return f"{value:.2f}" if value >= 0.1 else f"{value:.1g}"
