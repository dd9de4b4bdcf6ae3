"""The report of identified inertials (`flexcal identify inertials`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.estimation import Estimate
from flexcal.report.checks import LARGE, TOO_LARGE, Trust, check_residual
from flexcal.report.layout import (
    NOTHING,
    Check,
    Fact,
    Page,
    Section,
    Status,
    Table,
    Verdict,
    interval_words,
    scaled,
    significant,
)
from flexcal.report.sections import provenance_section

_HEADLINES: dict[Status, str] = {
    "good": "Identified, and both stages can begin from it",
    "care": "Identified, with reservations: read the checks below before relying on it",
    "bad": "Do not rely on these inertials yet",
    "unknown": "Identified; torques of other motions were not checked",
}


@dataclass(frozen=True, eq=False)
class InertialsStudy:
    """Identified inertials, as the folder has them: `results` is the document of results.json, `estimate` the block of estimates.yaml."""

    results: Mapping[str, Any]
    estimate: Estimate


def inertials_page(study: InertialsStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    return Page(
        title=f"{results['robot']}: inertials report",
        subtitle=f"Masses, centres of mass, rotors, friction from {results['trajectories']} exciting trajectories, with CAD as the prior",
        verdict=_verdict(study),
        sections=(
            Section("parameters", "Links and drives", _LEAD, (_table(study),)),
            provenance_section(results["command"], None, {}, study.estimate.provenance),
        ),
        document=results,
    )


_LEAD = (
    "Parameters that the recordings do not determine keep value and tolerance of robot.yaml. The "
    "last column is the ratio of prior to posterior standard deviation."
)


def _verdict(study: InertialsStudy) -> Verdict:
    error = study.results["error_percent"]
    checks = inertials_checks(study.results, study.estimate)
    trust = Trust(checks)
    before, after = (f"{significant(error[key], 3)}" for key in ("nominal", "train"))
    facts = (
        Fact(
            "How well were torques predicted?",
            before,
            "% relative error",
            "With the values of robot.yaml, up to 5 Hz.",
        ),
        Fact(
            "How well are they predicted?",
            after,
            "% relative error",
            "With the identified values, of the same recordings.",
        ),
        trust.fact(),
    )
    sentence = (
        f"Up to 5 Hz, the relative error of the predicted torques is {before} % with the nominal robot and "
        f"{after} % with the identified one."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", checks)


def inertials_checks(results: Mapping[str, Any], estimate: Estimate) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    return (
        _check_error(results["error_percent"]).named("torques"),
        check_residual("Does the measurement noise explain the residuals?", estimate).named("residual"),
    )


def _check_error(error: Mapping[str, float]) -> Check:
    question = "Does the identified robot explain the torques?"
    answer = f"The relative torque error is {significant(error['train'], 3)} %."
    if error["train"] > TOO_LARGE:
        return Check(question, f"{answer} The torques are not those of this robot.", "bad")
    if error["train"] > LARGE:
        return Check(
            question, f"{answer} That is large; check friction and the scale of the torques.", "care"
        )
    if error["train"] > error["nominal"]:
        return Check(question, f"{answer} The nominal values have a smaller error.", "care")
    return Check(question, answer, "good")


def _table(study: InertialsStudy) -> Table:
    rows = []
    for item in study.estimate.parameters:
        factor, unit = scaled(item.unit)
        std = study.estimate.std(item.name)
        bounds = interval_words(
            study.estimate, item.name, lambda v, factor=factor: significant(factor * v, 3)
        )
        wide = item.value * item.prior_std if item.scale == "log" else item.prior_std
        narrower = NOTHING if std is None or not 0 < wide < float("inf") else f"{wide / std:.1f} times"
        rows.append((item.name, unit, significant(factor * item.value, 4), bounds, narrower))
    return Table(
        "table-parameters",
        f"All {len(rows)} parameters",
        ("parameter", "unit", "estimate", "95 % interval", "prior std / posterior std"),
        tuple(rows),
        text_columns=(1,),
    )
