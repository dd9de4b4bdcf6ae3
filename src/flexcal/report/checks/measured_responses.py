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
_CLEAR, _SMALL_GAIN = 4.0, 0.02
"""Difference of two torque constants in standard deviations from which it is told, and the largest that does not matter, relative."""
_PLAUSIBLE_GAIN = 0.25
"""Logarithm of the ratio of two torque constants, known to 5 % each by default (3.5 σ), from which a gain or unit is wrong."""
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
    unlike = max(pairs, key=_gain_difference)
    if (worst["ratio"] > CHANCE or _gain_difference(unlike) > _CLEAR) and all(map(_by_gains, pairs)):
        first, second = unlike["joints"]
        return Check(
            question,
            f"They are with other torque constants. {answer} The true torque of {second} over that of "
            f"the log is {significant(unlike['gain_ratio'], 4)} ± {significant(unlike['gain_ratio_std'], 2)} (1σ) times that of {first}; "
            "'identify stiffness' estimates these factors (prior: torque_constant).",
            "care",
        )
    if worst["ratio"] > MISSING and worst["difference"] > _ASYMMETRY:
        return Check(
            question,
            f"No. {answer} Beyond noise and distortion they differ by {percent(worst['difference'])}. {cause}",
            "bad",
        )
    if worst["ratio"] > CHANCE:
        return Check(question, f"Not within their uncertainty. {answer} {cause}", "care")
    return Check(question, f"Yes. {answer}", "good")


def _gain_difference(pair: Mapping[str, Any]) -> float:
    """Difference of the drive gains of a pair of axes in standard deviations; 0 where it is too small to matter."""
    gain = pair.get("gain_ratio")
    if gain is None or abs(np.log(gain)) < _SMALL_GAIN:
        return 0.0
    return abs(float(np.log(gain))) * gain / pair["gain_ratio_std"]


def _by_gains(pair: Mapping[str, Any]) -> bool:
    """Whether the responses of a pair are reciprocal with torque constants that may be."""
    gain = pair.get("gain_ratio")  # none in results of earlier versions
    return gain is not None and pair["corrected_ratio"] <= CHANCE and abs(np.log(gain)) < _PLAUSIBLE_GAIN


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
