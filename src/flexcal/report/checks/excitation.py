"""The checks behind the verdict on the response of an axis to any excitation, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check, percent, significant

_COHERENT, _INCOHERENT = 0.95, 0.7
_CHANCE, _UNLIKE, _MATTERS = 1.5, 3.0, 0.03
"""Ratio of the halves' difference to its standard deviation from which it is significant, and large, and its relative size from which it
matters.
"""
_MISSED = 0.1
"""Relative difference of measured response and masses from which the masses do not describe the axis."""
_UNBIASED, _BIASED = 0.01, 0.05
"""Bias by feedback, relative, up to which it does not matter at 19 of 20 lines, and from which it is bad at the median one."""


def excitation_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks, from results.json."""
    return (
        _check_halves(results["halves"]).named("half_responses", independent=True),
        _check_coherence(results["elements"]).named("coherence"),
        _check_feedback(results.get("feedback")).named("feedback"),
        _check_resonances(results["resonances"]).named("resonances"),
        _check_masses(results["masses"]).named("masses"),
    )


def _check_halves(halves: Mapping[str, Any] | None) -> Check:
    question = "Do the first and the second half of the records give the same response?"
    if halves is None:
        return Check(
            question, "Cannot be judged: there is one record only. Record the experiment twice.", "unknown"
        )
    answer = (
        f"Their difference is {significant(halves['ratio'], 3)} times its standard deviation (rms over all lines), and "
        f"{percent(halves['relative'])} of the response (median)."
    )
    if halves["ratio"] > _CHANCE and halves["relative"] > _MATTERS:
        cause = "The axis may have changed (temperature), or be nonlinear and excited differently (friction, backlash)."
        return Check(question, f"No. {answer} {cause}", "bad" if halves["ratio"] > _UNLIKE else "care")
    return Check(question, f"Yes. {answer}", "good")


def _check_coherence(elements: Any) -> Check:
    question = "Does the input explain the output?"
    worst = min(elements, key=lambda item: item["coherence"])
    answer = f"The coherence of {worst['output']} is {significant(worst['coherence'], 4)} at the median line."
    cure = "Excite more strongly, record longer, or name further inputs; friction and backlash lower it too."
    if worst["coherence"] < _INCOHERENT:
        return Check(question, f"Hardly. {answer} {cure}", "bad")
    if worst["coherence"] < _COHERENT:
        return Check(question, f"Not well. {answer} {cure}", "care")
    return Check(question, f"Yes. {answer}", "good")


def _check_feedback(feedback: Mapping[str, Any] | None) -> Check:
    question = "Is the response free of what a controller feeds back?"
    if feedback is not None and feedback["reference"]:
        return Check(question, f"Yes: {feedback['reference']} tells the excitation from it.", "good")
    if feedback is None or feedback["acts"] is None:
        return Check(question, "Cannot be judged: the records are too short.", "unknown")
    if not feedback["acts"]:
        return Check(question, "Yes. No controller is seen to act on the output.", "good")
    answer = (
        f"A controller seems to act on the output; the noise that it feeds back biases the response by {percent(feedback['bias'])} "
        f"(median), and by {percent(feedback['worst_bias'])} or more at one line in twenty, the most near "
        f"{significant(feedback['worst_hz'], 3)} Hz."
    )
    if feedback["worst_bias"] < _UNBIASED:
        return Check(question, f"Yes. {answer}", "good")
    cure = "Name what the controller was asked for with --reference, or excite more strongly; intervals do not contain this. "
    cure += "Friction and backlash in repeated sweeps can look like a controller."
    return Check(question, f"No. {answer} {cure}", "bad" if feedback["bias"] > _BIASED else "care")


def _check_resonances(resonances: Any) -> Check:
    question = "Are the resonances determined?"
    if not resonances:
        return Check(question, "There is none in the excited band.", "unknown")
    lost = [item for item in resonances if not item["frequency_hz"]["identifiable"]]
    vague = [item for item in resonances if not item["damping"]["identifiable"]]
    if lost:
        return Check(question, f"{len(resonances) - len(lost)} of {len(resonances)}.", "care")
    if vague:
        where = ", ".join(f"{significant(item['frequency_hz']['estimate'], 3)} Hz" for item in vague)
        return Check(question, f"Their frequencies; not the damping at {where}.", "care")
    return Check(
        question,
        f"All {len(resonances)}, with their damping." if len(resonances) > 1 else "Yes, with its damping.",
        "good",
    )


def _check_masses(masses: Mapping[str, Any]) -> Check:
    question = "Does an axis of a few masses explain the response?"
    if not masses["count"]:
        return Check(question, f"None is fitted: {masses['reason']}.", "unknown")
    missing = masses["misfit"]
    answer = f"{masses['count']} {'mass' if masses['count'] == 1 else 'masses'} miss it by {percent(missing)} (rms)."
    if missing is None or missing > _MISSED:
        return Check(question, f"No. {answer} Do not use its inertias and stiffnesses.", "care")
    lost = [name for name, item in masses["parameters"].items() if not item["identifiable"]]
    if lost:
        return Check(question, f"{answer} Not determined: {', '.join(lost)}.", "care")
    return Check(question, f"Yes. {answer}", "good")
