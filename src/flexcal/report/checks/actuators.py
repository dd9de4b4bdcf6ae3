"""The checks behind the verdict on identified actuators, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check, percent, significant

_GOOD, _CARE = 0.1, 0.3
"""Shares of the tracking error that a simulation may miss."""
_NOISE = 2.0
"""Root mean square of the noise within which a simulation is as good as the measurement."""
_EXPLAINED, _EXACT = 1.5, 0.003
"""Ratio of residuals and noise up to which the model explains them, and the share of the tracking error that simulations themselves are
exact to.
"""
_WORSE = 1.5
"""Ratio of the errors outside the fit and in it from which the fit does not carry over."""


def actuator_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks; `results` is the document of results.json."""
    return (
        _check_held_out(results["errors"]).named("held_out_windows", independent=True),
        _check_carries_over(results["errors"]).named("carries_over", independent=True),
        _check_noise(results["errors"]).named("simulated_noise"),
        _check_determined(results["parameters"]).named("actuator_parameters"),
        _check_converged(results["fit"]).named("actuator_fit"),
    )


def _check_held_out(errors: Mapping[str, Any]) -> Check:
    question = "Does the simulation move like the robot, in windows outside the fit?"
    missed = {
        joint: item["held_out"]["simulated"] / item["held_out"]["commanded"]
        for joint, item in errors.items()
        if item["held_out"]["commanded"] > 0 and item["held_out"]["simulated"] > _NOISE * item["noise"]
    }
    if not missed:
        return Check(question, "Yes: within the noise of the measured positions, at every joint.", "good")
    joint = max(missed, key=lambda name: missed[name])
    own = errors[joint]["held_out"]
    answer = (
        f"The simulated position of {joint} differs from the measured one by {significant(own['simulated'], 3)} (rms, rad or m), the "
        f"command by {significant(own['commanded'], 3)}: the simulation misses {percent(missed[joint])} of the tracking error."
    )
    if missed[joint] > _CARE:
        return Check(
            question,
            f"No. {answer} Controller or friction are others than assumed: try --damping error; integral action and feed-forward "
            "torques are not in the model.",
            "bad",
        )
    return Check(question, answer, "good" if missed[joint] <= _GOOD else "care")


def _check_carries_over(errors: Mapping[str, Any]) -> Check:
    question = "Is it as good there as in the fit?"
    ratios = {
        joint: item["held_out"]["simulated"] / max(item["fitted"]["simulated"], item["noise"], 1e-300)
        for joint, item in errors.items()
    }
    joint = max(ratios, key=lambda name: ratios[name])
    answer = f"The errors are at most {significant(ratios[joint], 2)} times those of the fit, at {joint}."
    if ratios[joint] > _WORSE:
        return Check(question, f"No. {answer} Record motions of more kinds, or longer.", "care")
    return Check(question, f"Yes. {answer}", "good")


def _check_noise(errors: Mapping[str, Any]) -> Check:
    question = "Does the noise of the positions explain what the simulation misses?"
    ratios = {
        joint: item["fitted"]["simulated"] / max(item["noise"], 1e-300) for joint, item in errors.items()
    }
    joint = max(ratios, key=lambda name: ratios[name])
    answer = f"The residuals are at most {significant(ratios[joint], 2)} times the noise, at {joint}."
    share = errors[joint]["fitted"]["simulated"] / max(errors[joint]["fitted"]["commanded"], 1e-300)
    if ratios[joint] > _EXPLAINED and share > _EXACT:
        return Check(
            question,
            f"No. {answer} The controller has something that the model lacks, as integral action or feed-forward of the velocity "
            " (then try --damping error): the parameters imitate it, and may be far from the robot's own, outside their "
            "intervals.",
            "care",
        )
    return Check(question, f"Yes. {answer}", "good")


def _check_determined(parameters: Mapping[str, Mapping[str, Any]]) -> Check:
    question = "Do the logs tell every parameter?"
    open_ = [name.replace(".actuator.", ".") for name, item in parameters.items() if not item["identifiable"]]
    if len(open_) == len(parameters):
        return Check(question, "None of them.", "bad")
    if open_:
        return Check(
            question,
            f"Not {', '.join(open_)}. The simulation needs values for them and has those of the fit, which no other robot should use.",
            "care",
        )
    return Check(question, f"All {len(parameters)}.", "good")


def _check_converged(fit: Mapping[str, Any]) -> Check:
    question = "Did the fit converge?"
    if fit["status"] == "converged":
        return Check(question, f"Yes, after {fit['iterations']} iterations.", "good")
    return Check(question, f"No: {fit['message']}.", "care")
