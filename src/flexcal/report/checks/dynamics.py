"""The checks behind the verdict on identified dynamics, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from flexcal.report.layout import Check, listed, significant

MUCH_WORSE = 1.5
"""Held-out error over that in the fit, above which the model overfits or friction has changed."""
LARGE, TOO_LARGE = 10.0, 30.0
"""Relative torque errors, per cent, above which the prediction is poor, and above which it fails."""
JOINT_LARGE = 25.0
"""Relative torque error of a joint, per cent, above which it is predicted poorly; small torques are mostly friction."""
_SHOWN = 3
_OTHER_UNIT = 10 / 3
"""Factor between identified and declared gravity torque beyond which masses are rarely wrong, but units and gains are."""
_SENSOR = 0.1
"""Largest distance of 1 from the interval of the external torque ratio: axes rotated by half a radian."""


def check_unseen_torques(error: Mapping[str, Any], held_out: str) -> Check:
    """Whether torques outside the fit are predicted; `held_out` says which, empty for none."""
    question = "Does it predict torques outside the fit?"
    if not held_out:
        return Check(
            question,
            "Cannot be judged: nothing was held out. Identify again with --hold-out last:0.3, or with --validate and another recording.",
            "unknown",
        )
    unseen, train = error["held_out"], error["train"]
    answer = (
        f"The relative torque error is {significant(unseen, 3)} % on {held_out} and {significant(train, 3)} % in the fit. "
        "The friction terms were chosen without these data."
    )
    if unseen > TOO_LARGE:
        return Check(question, f"{answer} That is too large: the model is not valid there.", "bad")
    if unseen > MUCH_WORSE * train:
        return Check(
            question, f"{answer} That is much larger: friction changed, or the model overfits.", "care"
        )
    if unseen > LARGE:
        return Check(question, f"{answer} That is large; look at the spectra of the residuals.", "care")
    return Check(question, answer, "good")


def check_fit(train: float) -> Check | None:
    """Whether the torques of the fit itself are explained, by their relative error in per cent; None where they are."""
    if train <= LARGE:
        return None
    return Check(
        "Does the model explain the torques that it was fitted to?",
        f"Their relative error is {significant(train, 3)} %, more than {LARGE:.0f} %: friction or loads that the model lacks, "
        "noisy torques, or positions that are noise below the cut-off. The spectra of the residuals show the frequencies; "
        "a lower `cutoff_hz:` and more `decimation:` remove noise.",
        "bad" if train > TOO_LARGE else "care",
    )


def check_joints(per_joint: Mapping[str, float]) -> Check:
    """Whether the torques of every single joint are predicted."""
    question = "Is every joint predicted?"
    worst = max(per_joint, key=lambda joint: per_joint[joint])
    answer = f"The worst is {worst}: its relative torque error is {significant(per_joint[worst], 3)} %."
    if per_joint[worst] > JOINT_LARGE:
        return Check(question, f"{answer} Its torques are small, or its friction model is wrong.", "care")
    return Check(question, answer, "good")


def check_base(results: Mapping[str, Any]) -> Check:
    """Whether the recordings determine every base parameter of the model."""
    question = "Do the recordings determine every base parameter?"
    base, rank = results["base_parameters"], results["rank"]
    answer = f"{rank} of {len(base)} are determined, by {results['equations']} equations."
    if rank >= len(base):
        return Check(question, answer, "good")
    lost = [row["kept"] for row in base if row["std"] is None]
    return Check(
        question,
        f"{answer} Not {listed(lost, _SHOWN)}: a motion that excites them is missing.",
        "care",
    )


def check_bodies(bodiless: list[str]) -> Check:
    """Whether the inertials of every link are physically consistent."""
    question = "Are the inertials of every link physically consistent?"
    if not bodiless:
        return Check(question, "Yes: all masses and pseudo-inertias are positive.", "good")
    return Check(
        question,
        f"Not {', '.join(bodiless)}. Predicted torques do not depend on that, but springs and a URDF need consistent inertials: identify "
        f"with --estimator sdp.",
        "care",
    )


def check_shown(remarks: list[str]) -> Check:
    """Whether the recordings determine every declared parameter of the drives."""
    question = "Do the recordings determine every drive parameter?"
    if not remarks:
        return Check(question, "Yes.", "good")
    more = f"; and {len(remarks) - _SHOWN} more" if len(remarks) > _SHOWN else ""
    return Check(question, f"Not all: {'; '.join(remarks[:_SHOWN])}{more}.", "care")


def check_weight(faults: list[str]) -> Check:
    """Reservation about accepted torques that contradict the links' gravity torques."""
    question = "Do the torques hold the links' weight?"
    return Check(question, f"No, which was accepted: {faults[0]}.", "care")


def check_weight_shares(shares: Mapping[str, Mapping[str, float]], compared: int | None = None) -> Check:
    """Reservation about joints, named in `shares`, whose identified gravity torque differs much from that of the URDF.

    Where the gravity torque is far from that on all joints that were `compared`, the torques are the first to be doubted; something that
    carries the arm does so on one joint.
    """
    told = "; ".join(
        f"on {joint} {significant(max(0.0, share['share']), 2)} times that (95 % interval {significant(share['low'], 2)} to "
        f"{significant(share['high'], 2)})"
        for joint, share in list(shares.items())[:_SHOWN]
    )
    far = [
        name
        for name, share in shares.items()
        if share["high"] < 1 / _OTHER_UNIT or share["low"] > _OTHER_UNIT
    ]
    otherwise = (
        "something else carries the arm (declare springs under `dynamics: joint_springs:`; a counterweight belongs in the URDF) or loads "
        "it (a tool), or the URDF's masses are guesses (accept that with --accept weight)"
    )
    unlike = "in another unit (currents in A, or per cent), have a wrong gain, or are those of the motor instead of the joint"
    wrong = (
        "torques and masses are then wrong by that factor, which `tau: {gain: […]}` under `signals:` corrects"
    )
    if far and len(far) >= max(2, compared or 0):
        advice = (
            f"Check first whether the torques are {unlike}: {wrong}. If they are right, either {otherwise}."
        )
    elif far:
        named = ", ".join(far[:_SHOWN])
        advice = f"Either {otherwise}; torques are predicted all the same. Or the torques of {named} are {unlike}: {wrong}."
    else:
        advice = f"If the measured torques are right, so are the predicted ones, and either {otherwise}."
    return Check("Do the links weigh what the URDF says?", f"No: {told}. {advice}", "care")


def check_external(share: Mapping[str, float]) -> Check:
    """Check whether the motor torques agree with the force sensor."""
    question = "Do the motors feel what the force sensor reads?"
    size = f"{significant(share['share'], 3)} (95 % interval {significant(share['low'], 3)} to {significant(share['high'], 3)})"
    answer = f"The motor torques show {size} times the measured external torques."
    if share["high"] < 0:
        return Check(
            question, f"{answer} The sign is the other one: correct `wrench:` under `force_sensor:`.", "bad"
        )
    if share["low"] - _SENSOR > 1.0 or share["high"] + _SENSOR < 1.0:
        return Check(question, f"{answer} Check frame, axes, unit and time base of the sensor.", "bad")
    if share["low"] < 0.5 or share["high"] > 1.5:
        return Check(
            question, f"{answer} The external torques are too small to check the sensor by them.", "care"
        )
    return Check(question, answer, "good")


def held_out_recordings(results: Mapping[str, Any]) -> str:
    """The held-out data in words; empty for none."""
    block = results.get("hold_out", {})
    if block.get("logs"):
        return " and ".join(PurePath(log).name for log in block["logs"])
    return f"the last {100 * block['share']:.0f} % of every recording" if block.get("share") else ""


def dynamics_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    return (
        check_unseen_torques(results["error_percent"], held_out_recordings(results)).named(
            "held_out", independent=True
        ),
        *([fit.named("torques")] if (fit := check_fit(results["error_percent"]["train"])) else []),
        check_joints(results["error_percent"]["per_joint"]).named("joints"),
        check_base(results).named("base_parameters"),
        check_bodies(results["bodiless_links"]).named("bodies"),
        check_shown(results["remarks"]).named("drive_terms"),
        *([check_weight(faults).named("weight")] if (faults := results.get("weight_faults")) else []),
        *(
            [check_weight_shares(shares, results.get("weight_compared")).named("weight_shares")]
            if (shares := results.get("weight_shares"))
            else []
        ),
        *(
            [check_external(share).named("external_torques")]
            if (share := results.get("external_share"))
            else []
        ),
    )
