"""The checks behind the verdict on identified drive gains, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check, percent, significant

_WIDE = 0.05
"""1σ of a factor from which its gain is poorly determined."""
_UNLIKELY, _DIFFERENT = 0.01, 0.01
"""Probability of the difference between the halves, and its relative size, from which they do not agree."""


def gain_checks(
    factors: Mapping[str, Mapping[str, Any]], halves: Mapping[str, Any] | None
) -> tuple[Check, ...]:
    """The checks, from the blocks `parameters` and `halves` of results.json."""
    determined = {name: item for name, item in factors.items() if item["identifiable"]}
    return (
        _check_halves(halves).named("half_gains", independent=True),
        _check_determined(len(determined), len(factors)).named("gains"),
        _check_uncertainty(determined).named("gain_uncertainty"),
    )


def _check_halves(halves: Mapping[str, Any] | None) -> Check:
    question = "Do both halves of the recordings give the same gains?"
    if halves is None:
        return Check(question, "Cannot be judged: a half alone does not determine the gains.", "unknown")
    differences = {
        name.removesuffix(".drive_gain"): abs(item["second"] / item["first"] - 1)
        for name, item in halves["factors"].items()
    }
    joint = max(differences, key=lambda name: differences[name])
    answer = (
        f"The largest difference is {percent(differences[joint])}, at {joint}; p = {significant(halves['probability'], 2)} "
        "for the differences of all joints."
    )
    if halves["probability"] < _UNLIKELY and differences[joint] > _DIFFERENT:
        return Check(
            question,
            f"No. {answer} Friction may have changed with temperature: warm the robot up, and record again.",
            "care",
        )
    return Check(question, f"Yes. {answer}", "good")


def _check_determined(seen: int, total: int) -> Check:
    question = "Do the recordings determine every gain?"
    if not seen:
        return Check(question, "None: the payload changes no torque by enough.", "bad")
    if seen < total:
        return Check(
            question, f"{seen} of {total}; move the payload so that gravity loads the other joints.", "care"
        )
    return Check(question, f"All {total}.", "good")


def _check_uncertainty(seen: Mapping[str, Mapping[str, float]]) -> Check:
    question = "Are the gains known well?"
    wide = [name.removesuffix(".drive_gain") for name, item in seen.items() if item["std"] > _WIDE]
    if wide:
        return Check(
            question,
            f"Not of {', '.join(wide)}: worse than {100 * _WIDE:.0f} % (1σ). A heavier payload helps.",
            "care",
        )
    return Check(
        question, f"Each of them to {100 * _WIDE:.0f} % (1σ) or better.", "good" if seen else "unknown"
    )
