"""The report of springs and dampers from frequency responses (`flexcal identify stiffness`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.estimation import Estimate
from flexcal.report.checks import (
    Trust,
    check_drive_gains,
    check_response_bearings,
    check_responses,
    check_springs,
    check_torque_scale,
)
from flexcal.report.layout import Block, Check, Page, Section, Status, Text, Verdict, sentences
from flexcal.report.results import FittedResponse
from flexcal.report.sections import provenance_section, response_blocks, spring_table, unseen_springs

_HEADLINES: dict[Status, str] = {
    "good": "Springs identified, and the numbers can be trusted",
    "care": "Springs identified, with reservations: read the checks below before relying on them",
    "bad": "Do not rely on these springs yet",
    "unknown": "Springs identified; this stage alone has no independent check",
}


@dataclass(frozen=True, eq=False)
class StiffnessStudy:
    """Results of `identify stiffness`: the document of results.json, the block of estimates.yaml, and the responses by pose."""

    results: Mapping[str, Any]
    estimate: Estimate
    responses: tuple[FittedResponse, ...]


def springs_of(estimate: Estimate, kind: str) -> tuple[str, ...]:
    """Names of all stiffnesses or dampings."""
    return tuple(name for name in estimate.parameters.names if name.endswith(f".{kind}"))


def stiffness_page(study: StiffnessStudy) -> Page:
    """The page before it becomes HTML."""
    results, estimate = study.results, study.estimate
    return Page(
        title=f"{results['robot']}: stiffness report",
        subtitle="Stiffness and damping of drives and bearings, from frequency responses in "
        f"{len(study.responses)} {'pose' if len(study.responses) == 1 else 'poses'}",
        verdict=_verdict(study),
        sections=(
            Section("stage1", "Springs and dampers", "", _blocks(study)),
            provenance_section(results["command"], None, {}, estimate.provenance),
        ),
        document=results,
    )


def stiffness_checks(
    estimate: Estimate,
    bearings: Mapping[str, Any] | None = None,
    torque_scale: Mapping[str, Any] | None = None,
) -> tuple[Check, ...]:
    """The checks behind the verdict; `bearings` and `torque_scale` are blocks of results.json."""
    return (
        check_responses(estimate),
        check_springs(estimate, springs_of(estimate, "stiffness"), springs_of(estimate, "damping")).named(
            "springs"
        ),
        *check_response_bearings(bearings),
        *check_drive_gains(estimate),
        *check_torque_scale(torque_scale),
    )


def _verdict(study: StiffnessStudy) -> Verdict:
    checks = stiffness_checks(
        study.estimate, study.results.get("bearings"), (study.results.get("fit") or {}).get("torque_scale")
    )
    trust = Trust(checks)
    facts = (trust.fact(),)
    sentence = "Stiffness and damping were identified from frequency responses; measured positions verify the accuracy of the tool."
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", checks)


def _blocks(study: StiffnessStudy) -> tuple[Block, ...]:
    estimate = study.estimate
    stiffness, damping = springs_of(estimate, "stiffness"), springs_of(estimate, "damping")
    unseen = unseen_springs(estimate, (*stiffness, *damping))
    remarks = study.results.get("remarks", ())
    return (
        spring_table(estimate, stiffness, "stiffness", None, {}, ""),
        spring_table(estimate, damping, "damping", None, {}, ""),
        *((Text((), "Remarks", sentences(remarks)),) if remarks else ()),
        *((Text((), "Not determined by these data", unseen),) if unseen else ()),
        *response_blocks(study.responses, estimate),
    )
