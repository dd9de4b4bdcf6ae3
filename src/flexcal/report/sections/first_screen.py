"""The parts of the first screen that all reports share."""

from __future__ import annotations

from typing import Literal

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.report.checks import Trust
from flexcal.report.layout import NOTHING, ErrorRange, Fact, millimetres


def headline_facts(
    before: ErrorStatistics | None, after: ErrorStatistics, trust: Trust, noun: str
) -> tuple[Fact, ...]:
    """Facts of the first screen: accuracy before and after, and trust; `noun` is poses or points."""
    was = _fact(
        "How accurate was it?", before, f"P90 over the {noun}, the robot's own error before calibration."
    )
    now = _fact("How accurate is it?", after, f"P90 over the {noun}, calibrated.")
    return (was, now, trust.fact())


def error_range(
    label: str, s: ErrorStatistics, kind: Literal["nominal", "rigid", "elastic", "floor", "published"]
) -> ErrorRange:
    """An error range of the scale from error statistics."""
    return ErrorRange(label, s.mean, s.p90, s.max, kind)


def _fact(question: str, s: ErrorStatistics | None, words: str) -> Fact:
    if s is None:
        return Fact(question, NOTHING, "", "Too few poses to tell.")
    spread = f"Mean {millimetres(s.mean)}, maximum {millimetres(s.max)} mm."
    return Fact(question, millimetres(s.p90), "mm", f"{words} {spread}")
