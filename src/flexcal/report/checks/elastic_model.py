"""Check whether the fitted elastic model explains the measured frequency responses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.estimation import Estimate, Misfit, Parameter
from flexcal.model.robot import DRIVE_GAIN
from flexcal.report.checks.pose_errors import check_residual
from flexcal.report.layout import Check, listed, spring_label
from flexcal.report.results import chance_in_words

CODE = "residual_stiffness"
QUESTION = "Does the elastic model explain the frequency responses?"


def check_responses(estimate: Estimate) -> Check:
    """The check of an estimate of stage 1."""
    if estimate.misfit is not None and estimate.converged:
        return check_misfit(estimate.misfit)
    return check_residual(QUESTION, estimate).named(CODE)


def check_misfit(misfit: Misfit | None) -> Check:
    """The check of the misfit of stage 1, for the stages that use its springs."""
    if misfit is None:
        return Check(QUESTION, "Yes, within noise and model error.", "good", CODE)
    return Check(QUESTION, misfit_sentences(misfit), "bad" if misfit.severe else "care", CODE)


_ANOTHER_UNIT = 1.5
"""Factor of all inertia, or its inverse, from which no masses are likely to be the cause."""


def check_torque_scale(scale: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """Where all inertia came out at another size than was known, as the block `torque_scale` of results.json has it."""
    if scale is None:
        return ()
    far = max(scale["factor"], 1 / scale["factor"]) > _ANOTHER_UNIT
    answer = f"No: {torque_scale_sentence(scale)}."
    return (Check("Are the torques in N m at the joint?", answer, "bad" if far else "care", "torque_scale"),)


def torque_scale_sentence(scale: Mapping[str, Any]) -> str:
    """What it means that all inertia came out at another size than was known."""
    return (
        f"masses and rotor inertias all come out at {scale['factor']:.3g} times those of URDF and robot.yaml, beyond what `prior:` allows "
        f"them ({chance_in_words(scale['p'])}): either those are wrong, or the torques are, as motor currents in A, torques at the motor, "
        "or another torque constant; stiffness and damping are then wrong by the same factor, and their intervals allow for it. Check the "
        "unit of the torques (flexcal identify gains finds it from a payload), or correct the masses"
    )


_OFF = 3.0
"""Deviation of a drive gain from one, in standard deviations, from which torque constants are named as a cause."""


def drive_gain_sentence(estimate: Estimate) -> str:
    """What is known of the torque constants where they are not those of the log, beyond chance; empty where they may be."""
    parts = [
        f"{item.name.removesuffix(f'.{DRIVE_GAIN}')} {item.value:.3g} ± {item.value * std:.2g}"
        for item, std in _drive_gains(estimate)
        if abs(np.log(item.value)) > _OFF * std
    ]
    if not parts:
        return ""
    return (
        f"the torques of the log are off, as by torque constants: the true ones are greater by the factors {listed(parts, len(parts))} "
        "(1σ), by the reciprocity of the responses and by what is known of masses and payload; springs are those of the true torques"
    )


def check_drive_gains(estimate: Estimate) -> tuple[Check, ...]:
    """Where a torque constant is farther from that of the log than what `prior: torque_constant` allows."""
    if all(
        abs(np.log(item.value)) < _OFF * np.hypot(item.prior_std, std) for item, std in _drive_gains(estimate)
    ):
        return ()
    question = "Are the torque constants as well known as declared?"
    return (Check(question, f"No: {drive_gain_sentence(estimate)}.", "care", "torque_constants"),)


def _drive_gains(estimate: Estimate) -> list[tuple[Parameter, float]]:
    """Drive gains with the standard deviation of their logarithms."""
    stds = np.sqrt(np.diag(estimate.covariance))
    pairs = zip(estimate.parameters, stds, strict=True)
    return [(item, float(std)) for item, std in pairs if item.name.endswith(f".{DRIVE_GAIN}")]


def misfit_sentences(misfit: Misfit) -> str:
    """Pose, band and motor of a misfit, possible causes, and its effect on the intervals."""
    where = (
        f"Not in pose {misfit.pose} from {misfit.low_hz:.0f} to {misfit.high_hz:.0f} Hz, most at {_place(misfit.axis)}: the residual "
        f"is {misfit.peak**0.5:.1f} times its standard deviation there (χ² per degree of freedom is {misfit.reduced_chi2:.2f} "
        "overall). "
    )
    far = ""
    if misfit.far:
        springs = ", ".join(spring_label(name) for name in misfit.far)
        far = f"More than a factor of 3 from robot.yaml: {springs}. "
    moved = ""
    if misfit.inertials > 0:
        moved = (
            f"Masses and centres of mass moved by {misfit.inertials:.1f} standard deviations of what was known of them (root mean square): "
            "they take up a part of what the model lacks, and are given without intervals. "
        )
    cause = (
        "The model lacks a mode or has wrong parameters. Possible causes: elasticity of base, tool or payload, wrong bearing axes, "
        "friction that is not kept sliding by the reference motion, "
        "or a plan.yaml that does not belong to the recordings. "
    )
    if misfit.axis.startswith("sensor "):
        cause = (
            f"Possible causes: a wrong direction, xyz or frame of the {misfit.axis} under `sensors:`, a loose mount, or a mode that the "
            "model lacks; a fit without its column tells which. "
        )
    if misfit.severe:
        return f"{where}{far}{cause}{moved}Do not use these springs; their intervals are at least as wide as robot.yaml's tolerance."
    return f"{where}{far}{cause}{moved}The intervals of all springs were widened accordingly."


def misfit_document(misfit: Misfit | None) -> dict[str, Any] | None:
    """Misfit as in results.json."""
    return None if misfit is None else dict(vars(misfit)) | {"far": list(misfit.far)}


def read_misfit(document: Mapping[str, Any] | None) -> Misfit | None:
    """The inverse of `misfit_document`."""
    return None if document is None else Misfit(**{**document, "far": tuple(document["far"])})


def _place(output: str) -> str:
    return f"the {output}" if output.startswith("sensor ") else f"the motor of {output}"
