"""Whether the elastic robot explains the measured frequency responses, and what follows for everything built on its springs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.estimation import Estimate, Misfit
from flexcal.report.checks import check_residual
from flexcal.report.notation import spring_label
from flexcal.report.page import Check

CODE = "residual_stiffness"
QUESTION = "Does the elastic model explain the frequency responses?"


def check_responses(estimate: Estimate) -> Check:
    """Of the estimate of stage 1."""
    if estimate.misfit is not None and estimate.converged:
        return check_misfit(estimate.misfit)
    return check_residual(QUESTION, estimate).named(CODE)


def check_misfit(misfit: Misfit | None) -> Check:
    """Of what stage 1 has left unexplained, for the stages that use its springs."""
    if misfit is None:
        return Check(QUESTION, "Yes, within noise and model error.", "good", CODE)
    return Check(QUESTION, misfit_sentences(misfit), "bad" if misfit.severe else "care", CODE)


def misfit_sentences(misfit: Misfit) -> str:
    """Where the responses are not explained, what to look for, and what it does to the springs."""
    where = (
        f"Not in pose {misfit.pose} from {misfit.low_hz:.0f} to {misfit.high_hz:.0f} Hz, most at the motor of {misfit.axis}: the residual "
        f"is {misfit.peak**0.5:.1f} times what noise and model error explain there (χ² per degree of freedom is {misfit.reduced_chi2:.2f} "
        "overall). "
    )
    far = ""
    if misfit.far:
        springs = ", ".join(spring_label(name) for name in misfit.far)
        far = f"More than a factor of 3 from robot.yaml: {springs}. "
    cause = (
        "The model lacks a mode or has wrong parameters: look for a base, a tool or a payload that gives way, for bearing axes declared "
        "wrongly, and for a plan.yaml that is not that of the recordings. "
    )
    if misfit.severe:
        return f"{where}{far}{cause}Do not build on these springs; their intervals are at least as wide as robot.yaml's tolerance."
    return f"{where}{far}{cause}The intervals of all springs were widened to match."


def misfit_document(misfit: Misfit | None) -> dict[str, Any] | None:
    """As results.json has it."""
    return None if misfit is None else dict(vars(misfit)) | {"far": list(misfit.far)}


def read_misfit(document: Mapping[str, Any] | None) -> Misfit | None:
    """What `misfit_document` left."""
    return None if document is None else Misfit(**{**document, "far": tuple(document["far"])})
