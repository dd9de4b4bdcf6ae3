"""The verdict on a result, and its deciding checks (`verdict` of results.json)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.report.layout import Check, Fact, Status, tally

NO_INDEPENDENT_CHECK = "no_independent_check"

ANSWERS: dict[Status, str] = {
    "good": "Yes",
    "care": "With care",
    "bad": "No",
    "unknown": "Cannot be judged",
}


@dataclass(frozen=True)
class Trust:
    """Verdict from the checks of a result.

    It is "bad" where a check is, "unknown" where no independent check was made or one of these cannot be judged, "care" where any check
    has reservations, and "good" only where every independent check passed and no other has reservations.
    """

    checks: tuple[Check, ...] = ()

    @property
    def status(self) -> Status:
        """The verdict as one of the four judgements."""
        independent = [check.status for check in self.checks if check.independent]
        if any(check.status == "bad" for check in self.checks):
            return "bad"
        if not independent or "unknown" in independent:
            return "unknown"
        return "care" if any(check.status == "care" for check in self.checks) else "good"

    @property
    def trusted(self) -> bool | None:
        """True, false, or None with reservations or without a basis for a judgement."""
        return {"good": True, "bad": False}.get(self.status)

    @property
    def deciding(self) -> tuple[Check, ...]:
        """The checks that decide: the independent ones that passed, the bad ones, or those that leave it open."""
        status = self.status
        if status == "good":
            return tuple(check for check in self.checks if check.independent)
        if status != "unknown":
            return tuple(check for check in self.checks if check.status == status)
        unknown = [check for check in self.checks if check.independent and check.status == "unknown"]
        return (*unknown, *(check for check in self.checks if check.status == "care"))

    @property
    def because(self) -> str:
        """Findings of the deciding checks, as clauses."""
        phrases = [_phrase(check) for check in self.deciding]
        if NO_INDEPENDENT_CHECK in self.reasons:
            phrases.insert(0, "no independent check was made")
        return "; ".join(dict.fromkeys(phrases))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Codes of the deciding checks; of a result without an independent check the first is NO_INDEPENDENT_CHECK."""
        codes = tuple(check.code for check in self.deciding)
        return codes if any(check.independent for check in self.checks) else (*self._lacking, *codes)

    @property
    def _lacking(self) -> tuple[str, ...]:
        return (NO_INDEPENDENT_CHECK,) if self.status == "unknown" else ()

    def document(self) -> dict[str, Any]:
        """The block `verdict` of results.json."""
        return {"trusted": self.trusted, "reasons": list(self.reasons)}

    @property
    def sentence(self) -> str:
        """The verdict in one line, for the console."""
        return f"Trusted: {ANSWERS[self.status].lower()} — because {self.because}"

    def fact(self) -> Fact:
        """The verdict on the first screen."""
        return Fact(
            "Can I trust it?",
            ANSWERS[self.status],
            "",
            f"{tally(self.checks)}; each is explained below.",
            self.status,
        )


def verdict_answer(verdict: Mapping[str, Any]) -> str:
    """Yes, no, or neither in words, from the block `verdict` of results.json."""
    answers = {True: "Yes", False: "No", None: "Cannot be judged, or only with reservations"}
    return answers[verdict["trusted"]]


def _phrase(check: Check) -> str:
    """Finding of a check, as a clause."""
    known = PHRASES[check.code]
    return known.get(check.status, known["else"])


PHRASES: dict[str, dict[str, str]] = {
    "external_torques": {
        "good": "motors and force sensor agree",
        "care": "the external torques are too small to check the force sensor",
        "else": "the motors do not feel what the force sensor reads: check the sign (`wrench:`), frame and unit of `force_sensor:`",
    },
    "weight": {"else": "the torques do not hold the links' weight, which was accepted"},
    "weight_shares": {"else": "on a joint the links weigh far less or more than the URDF says"},
    "left_out": {
        "good": "poses left out of the fit are predicted as accurately as expected",
        "unknown": "no poses outside the fit were predicted",
        "else": "poses left out of the fit are predicted worse than expected",
    },
    "groups_left_out": {
        "good": "whole groups left out of the fit are predicted as accurately as expected",
        "else": "whole groups left out of the fit are predicted worse than expected",
    },
    "own_verdict": {"else": "the calibration itself was not trusted"},
    "improvement": {
        "good": "the errors are smaller than before",
        "else": "the errors are no smaller than before, or by chance",
    },
    "worsening": {"else": "the errors are larger than before"},
    "unseen_poses": {
        "good": "no pose was used for the fit",
        "else": "the calibration was fitted to these poses",
    },
    "enough_poses": {"good": "enough poses were measured", "else": "few poses were measured"},
    "fresh_poses": {
        "good": "poses outside the fit are as accurate as those of the fit",
        "else": "poses outside the fit are few, or less accurate than those of the fit",
    },
    "claimed_uncertainty": {
        "good": "errors at poses outside the fit are within what was predicted",
        "care": "errors are larger than predicted",
        "bad": "errors are far larger than predicted",
        "else": "errors cannot be compared with a predicted uncertainty",
    },
    "instrument_noise": {
        "good": "the instrument's noise is known",
        "else": "the instrument's noise is not known",
    },
    "residual": {
        "good": "the noise explains the residuals",
        "bad": "the robot as declared does not explain the measured points",
        "care": "the residuals do not agree with the stated noise",
        "else": "no measurement noise is stated",
    },
    "model_error": {"else": "systematic model errors are larger than the noise"},
    "residual_stiffness": {
        "good": "the noise explains the residuals of the frequency responses",
        "bad": "the fit does not explain the frequency responses",
        "care": "the residuals of the frequency responses do not agree with their covariance",
        "else": "the frequency responses have no covariance",
    },
    "rank": {
        "good": "the rank is clear",
        "else": "it is not clear which parameters the poses determine",
    },
    "gain": {"else": "the robot is hardly more accurate than before the calibration"},
    "extent": {
        "good": "predicted errors are about as small everywhere",
        "else": "it is accurate only near the calibrated poses",
    },
    "size": {"else": "lengths that it has its size from do not go together"},
    "drift": {"good": "no drift was detected", "else": "residuals drift with time"},
    "torque_constants": {"else": "torque constants are farther off than declared"},
    "torque_scale": {
        "else": "all masses come out at another size than declared, or the torques are in another unit"
    },
    "lag": {"else": "points and joint positions were not read at the same instant, while the robot moved"},
    "instrument_change": {"else": "the instrument's readings change with temperature or time"},
    "temperature_sensor": {
        "else": "the temperature may be measured too late or too imprecisely for its coefficients"
    },
    "bearings": {
        "good": "the bearings tilt about the right axes",
        "else": "the data fit other bearing axes than the declared ones",
    },
    "fleet": {
        "good": "the robot is like those that its prior is from",
        "else": "the prior of other robots does not fit this one",
    },
    "outliers": {"good": "there are no outliers", "else": "there are outliers"},
    "places": {
        "good": "the places of the fixture agree",
        "unknown": "there are too few places of the fixture to compare",
        "else": "a place of the fixture disagrees with the others",
    },
    "one_robot": {"else": "the places of the fixture are not consistent with one robot"},
    "springs": {
        "good": "all stiffnesses are determined",
        "else": "the data do not determine every stiffness",
    },
    "moved": {"else": "the instrument or the measured point is not where it was at the calibration"},
    "calibrated_points": {"else": "the calibration did not measure every point"},
    "flanks": {
        "good": "backlash is taken up",
        "else": "the flank of the backlash is uncertain at many poses",
    },
    "held_out": {
        "good": "torques of recordings outside the fit are predicted",
        "bad": "torques of recordings outside the fit are not predicted",
        "care": "torques of recordings outside the fit are predicted with a large error",
        "else": "no recording was kept out of the fit",
    },
    "joints": {
        "good": "the torques of every joint are predicted",
        "else": "the torques of a joint are predicted badly",
    },
    "base_parameters": {
        "good": "all base parameters are determined",
        "else": "the recordings do not determine every base parameter",
    },
    "bodies": {
        "good": "the inertials are physically consistent",
        "else": "the inertials are not physically consistent",
    },
    "drive_terms": {
        "good": "all drive parameters are determined",
        "else": "the recordings do not determine every drive parameter",
    },
    "torques": {
        "good": "the torques are explained",
        "bad": "the fit does not explain the torques",
        "else": "the torque error is large",
    },
    "reciprocity": {
        "good": "the responses are reciprocal within their uncertainty",
        "bad": "the responses are not reciprocal",
        "care": "the responses are not reciprocal within their uncertainty",
        "else": "reciprocity cannot be judged",
    },
    "response_uncertainty": {
        "good": "the responses are known well",
        "else": "the uncertainty of the responses is large",
    },
    "excited_axes": {"good": "every axis is excited", "else": "an axis is hardly excited in a pose"},
    "equal_poses": {
        "good": "the uncertainty is alike in all poses",
        "else": "a pose is much more uncertain than the others",
    },
    "degrees_of_freedom": {
        "good": "the covariance is well estimated",
        "else": "the covariance has few degrees of freedom",
    },
    "half_responses": {
        "good": "both halves of the records give the same response",
        "unknown": "there is one record only",
        "else": "the two halves of the records give different responses",
    },
    "coherence": {
        "good": "the input explains the output",
        "else": "the coherence is low",
    },
    "feedback": {
        "good": "no feedback biases the response",
        "unknown": "feedback cannot be judged",
        "else": "noise that a controller feeds back biases the response",
    },
    "resonances": {
        "good": "all resonances are determined",
        "unknown": "there is no resonance in the band",
        "else": "a resonance or its damping is not determined",
    },
    "masses": {
        "good": "an axis of a few masses explains the response",
        "unknown": "no masses were fitted",
        "else": "the axis of masses describes the response badly, or is not determined",
    },
    "held_out_windows": {
        "good": "the simulation moves like the robot in windows outside the fit",
        "care": "the simulation misses some of the tracking error in windows outside the fit",
        "else": "the simulation does not move like the robot in windows outside the fit",
    },
    "carries_over": {
        "good": "the simulation is as good outside the fit as in it",
        "else": "the simulation is worse outside the fit than in it",
    },
    "simulated_noise": {
        "good": "the model explains the measured positions",
        "else": "the controller has something that the model lacks, so that parameters may be far from the robot's own",
    },
    "actuator_parameters": {
        "good": "the logs tell every parameter",
        "bad": "the logs tell no parameter",
        "else": "the logs do not tell every parameter",
    },
    "actuator_fit": {"good": "the fit converged", "else": "the fit did not converge"},
    "half_gains": {
        "good": "the first and the second half of the recordings give the same gains",
        "unknown": "the recordings are too short to compare their halves",
        "else": "the first and the second half of the recordings give different gains",
    },
    "gains": {
        "good": "all gains are determined",
        "bad": "the recordings determine no gain",
        "else": "the recordings do not determine every gain",
    },
    "gain_uncertainty": {
        "good": "the gains are known well",
        "unknown": "no gain is determined",
        "else": "a gain is known poorly",
    },
    "mass": {"good": "the mass is known well", "else": "the mass is known poorly"},
    "payload_parameters": {
        "good": "all payload parameters are determined",
        "else": "the recordings do not determine the centre of mass",
    },
    "declared_mass": {
        "good": "the mass agrees with the declared one",
        "unknown": "no payload mass is declared to compare with",
        "else": "the mass differs from the declared one",
    },
    "other_estimates": {
        "good": "the robot's other estimates assume this payload",
        "else": "the robot's other estimates assume another payload",
    },
}
"""Finding of each check, as a clause, by code and status; "else" if a status has no clause of its own."""
