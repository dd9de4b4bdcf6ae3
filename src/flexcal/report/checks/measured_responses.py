"""The checks behind the verdict on measured frequency responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from flexcal.frequency.periodic import FrequencyResponse
from flexcal.report.checks.pose_errors import CHANCE, MISSING
from flexcal.report.layout import Check, listed, percent, significant
from flexcal.report.results import relative_to_diagonal

Limit = Literal["noise", "distortion"]

_LARGE, _TOO_LARGE = 0.1, 0.3
"""Relative 1σ of a response from which it is poorly determined, and from which the weight of its logarithm is wrong (to first order)."""
_UNLIKE = 2.0
"""Ratio to the median pose from which a pose is an outlier."""
_FREEDOM = 20
_FEW_LINES = 20
"""Lines of all poses below which the difference of two elements says little."""
_ASYMMETRY = 0.1
"""Difference of G_ij and G_ji beyond noise, relative to their size, from which the responses are not those of one mechanical system."""
_SHOWN = 3
_CURES: dict[Limit, str] = {
    "noise": "Noise dominates: record more periods, or increase the torques.",
    "distortion": "Nonlinear distortion dominates: record more realisations; more periods of the same do not lower it.",
}


def limit_of(entries: Sequence[Mapping[str, Any]]) -> Limit:
    """Source of more than half of the variance over all poses; `entries` are `responses` of results.json."""
    noise, total = (
        sum(entry[key] ** 2 for entry in entries) for key in ("relative_noise_std", "relative_std")
    )
    return "noise" if noise > total / 2 else "distortion"


def worst_pose(entries: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Pose with the largest relative standard deviation."""
    return max(entries, key=lambda entry: entry["relative_std"])


def response_checks(results: Mapping[str, Any], responses: Sequence[FrequencyResponse]) -> tuple[Check, ...]:
    """The checks behind the verdict, from results.json and its responses."""
    entries = results["responses"]
    return (
        _check_reciprocity(results["reciprocity"]).named("reciprocity", independent=True),
        _check_known(entries).named("response_uncertainty"),
        _check_axes(responses).named("excited_axes"),
        _check_poses(entries).named("equal_poses"),
        _check_freedom(entries).named("degrees_of_freedom"),
    )


def _check_reciprocity(pairs: Sequence[Mapping[str, Any]]) -> Check:
    question = "Are the responses reciprocal (G_ij = G_ji)?"
    if not pairs:
        return Check(question, "Cannot be judged: one axis only was excited.", "unknown")
    worst = max(pairs, key=lambda pair: pair["ratio"])
    if worst["lines"] < _FEW_LINES:
        return Check(question, f"Cannot be judged from {worst['lines']} lines.", "unknown")
    answer = (
        f"The difference between the responses of {' and '.join(worst['joints'])} to torques at each other is "
        f"{significant(worst['ratio'], 3)} times its standard deviation (rms over all lines), the largest of all pairs."
    )
    cause = "Check torque gain and sign of these axes, and the order of the columns."
    if worst["ratio"] > MISSING and worst["difference"] > _ASYMMETRY:
        return Check(
            question,
            f"No. {answer} Beyond noise and distortion they differ by {percent(worst['difference'])}. {cause}",
            "bad",
        )
    if worst["ratio"] > CHANCE:
        return Check(question, f"Not within their uncertainty. {answer} {cause}", "care")
    return Check(question, f"Yes. {answer}", "good")


def _check_known(entries: Sequence[Mapping[str, Any]]) -> Check:
    question = "Is the uncertainty of the responses small?"
    worst = worst_pose(entries)
    answer = f"{percent(worst['relative_std'])} (1σ, median over lines and axes) in pose {worst['pose']}, the worst."
    if worst["relative_std"] > _TOO_LARGE:
        return Check(question, f"{answer} {_CURES[limit_of(entries)]}", "bad")
    if worst["relative_std"] > _LARGE:
        return Check(question, f"{answer} {_CURES[limit_of(entries)]}", "care")
    return Check(question, answer, "good")


def _check_axes(responses: Sequence[FrequencyResponse]) -> Check:
    question = "Is every axis excited in every pose?"
    lost = [
        f"{joint} in pose {response.pose + 1}"
        for response in responses
        for joint, share in zip(
            response.joints,
            np.median(relative_to_diagonal(response.std, response.response), axis=0),
            strict=True,
        )
        if share > _TOO_LARGE
    ]
    if not lost:
        return Check(question, f"Yes, to {100 * _TOO_LARGE:.0f} % or better at half of the lines.", "good")
    return Check(
        question,
        f"Not {listed(lost, _SHOWN)}: 1σ is more than {100 * _TOO_LARGE:.0f} % of the response at half of the lines. Increase "
        f"the torques of these "
        "axes.",
        "care",
    )


def _check_poses(entries: Sequence[Mapping[str, Any]]) -> Check:
    question = "Is the uncertainty alike in all poses?"
    if len(entries) == 1:
        return Check(question, "There is one pose only.", "unknown")
    worst, middle = worst_pose(entries), float(np.median([entry["relative_std"] for entry in entries]))
    times = worst["relative_std"] / middle
    if times > _UNLIKE:
        return Check(
            question,
            f"Not pose {worst['pose']}: its standard deviation is {significant(times, 2)} times the median pose's; look at its recordings.",
            "care",
        )
    return Check(
        question,
        f"The largest standard deviation is {significant(times, 2)} times the median pose's.",
        "good",
    )


def _check_freedom(entries: Sequence[Mapping[str, Any]]) -> Check:
    question = "Is the uncertainty itself well estimated?"
    freedom = min(entry["degrees_of_freedom"] for entry in entries)
    answer = f"It has {freedom:.0f} degrees of freedom, a relative standard deviation of {percent((2 * freedom) ** -0.5)}."
    if freedom < _FREEDOM:
        return Check(
            question, f"{answer} Springs are weighted by it; measure more lines or realisations.", "care"
        )
    return Check(question, answer, "good")
