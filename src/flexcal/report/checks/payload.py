"""The checks behind the verdict on an identified payload, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.checks.dynamics import LARGE, TOO_LARGE, check_weight
from flexcal.report.layout import Check, significant

BODILESS = 29.6
"""99.9 % quantile of χ² with ten degrees of freedom: largest increase of the sum of squares by physical consistency."""
UNLIKE = 3.0
"""Torque error over that of separate fits of every joint and recording, above which the robot's dynamics do not fit."""
_WIDE = 0.05
"""Relative standard deviation of the mass above which it is poorly determined."""


def payload_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks behind the verdict."""
    return (
        _check_torques(results["error_percent"]).named("torques"),
        _check_body(results["body_rise"]).named("bodies"),
        _check_mass(results["parameters"]["payload.mass"], results.get("robot_mass_kg", 0.0)).named("mass"),
        _check_told(results["parameters"]).named("payload_parameters"),
        _check_declared(results["parameters"]["payload.mass"], results["declared"]).named(
            "declared_mass", independent=True
        ),
        _check_others(results["other_payloads"]).named("other_estimates"),
        *([check_weight(faults).named("weight")] if (faults := results.get("weight_faults")) else []),
    )


def _check_torques(error: Mapping[str, Any]) -> Check:
    question = "Do robot and payload explain the torques?"
    train, best = error["train"], error["best"]
    answer = f"{significant(train, 3)} % is the relative torque error"
    answer += (
        f"; the noise alone, from separate fits of every joint and recording, is {significant(best, 3)} %."
        if best
        else "."
    )
    if train > TOO_LARGE:
        return Check(question, f"{answer} The torques are not those of this robot with a payload.", "bad")
    if best and train > UNLIKE * best:
        return Check(
            question,
            f"{answer} The robot's own dynamics do not fit these recordings: identify them again, or give recordings with --free.",
            "care",
        )
    if train > LARGE:
        return Check(question, f"{answer} That is large; look at the torques below.", "care")
    return Check(question, answer, "good")


def _check_body(rise: float) -> Check:
    question = "Is the payload physically consistent?"
    if rise > BODILESS:
        return Check(
            question,
            f"No: the nearest consistent payload raises the sum of squares by {significant(rise, 3)}; by chance this exceeds "
            f"{BODILESS:g} once in a thousand. Check the drive gains, the robot's own dynamics and the frame.",
            "care",
        )
    if rise > 0:
        return Check(
            question,
            f"The nearest consistent one raises the sum of squares by {significant(rise, 3)}, which noise explains.",
            "good",
        )
    return Check(question, "Yes: mass and inertia are physically consistent.", "good")


def _check_mass(mass: Mapping[str, float], robot: float) -> Check:
    question = "Is the mass known well?"
    if 0 < robot < mass["low"]:
        return Check(
            question,
            f"No: {significant(mass['estimate'], 3)} kg is more than all links of the robot together ({significant(robot, 3)} kg): no "
            "robot lifts that; check that the torques are in N m at the joints, and the robot's own dynamics.",
            "bad",
        )
    share = 100 * mass["std"] / mass["estimate"]
    if share > 100 * _WIDE:
        return Check(
            question,
            f"Only to {significant(share, 2)} % (1σ); move the joints that lift it through more of their range, or give more recordings.",
            "care",
        )
    return Check(question, f"To {significant(share, 2)} % (1σ).", "good")


def _check_told(parameters: Mapping[str, Mapping[str, Any]]) -> Check:
    question = "Do the recordings determine all parameters?"
    hidden = [name.removeprefix("payload.") for name, item in parameters.items() if not item["identifiable"]]
    if not hidden:
        return Check(question, "Mass, centre of mass and inertia are determined.", "good")
    names = ", ".join(hidden)
    if any(name.startswith("com") for name in hidden):
        return Check(
            question,
            f"Not {names}; rotate the payload about other axes, so that gravity acts from more directions.",
            "care",
        )
    return Check(
        question,
        f"All but the inertia ({names}), which needs faster rotations; positions at rest do not depend on it.",
        "good",
    )


def _check_declared(mass: Mapping[str, float], declared: Mapping[str, float] | None) -> Check:
    question = "Is the mass what robot.yaml declares?"
    if declared is None:
        return Check(question, "robot.yaml declares no payload to compare with.", "unknown")
    weight = declared["payload.mass"]
    if mass["low"] <= weight <= mass["high"]:
        return Check(question, f"Yes: {weight:g} kg lies within the 95 % interval.", "good")
    far = abs(mass["estimate"] - weight) / weight if weight > 0 else None
    size = "" if far is None else f"{significant(100 * far, 2)} % "
    side = "above" if mass["estimate"] > weight else "below"
    return Check(
        question,
        f"No: it is {size}{side} the declared {weight:g} kg. The identified mass is used where these estimates are read; if a scale "
        "agrees with robot.yaml, the torques or the robot's own dynamics are wrong.",
        "care",
    )


def _check_others(others: Mapping[str, float]) -> Check:
    question = "Were the robot's other estimates made with this payload?"
    if not others:
        return Check(question, "None was made with another one.", "good")
    payloads = ", ".join(f"'{name}' with {mass:.4g} kg" for name, mass in others.items())
    return Check(
        question, f"Not {payloads}; if the robot held this payload then, make these estimates again.", "care"
    )
