"""The report of identified dynamics (`flexcal identify dynamics`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.estimation import Estimate
from flexcal.report.checks import (
    Trust,
    check_base,
    check_bodies,
    check_external,
    check_fit,
    check_joints,
    check_shown,
    check_unseen_torques,
    check_weight,
    check_weight_shares,
)
from flexcal.report.layout import Check, Fact, Page, Section, Status, Verdict, significant
from flexcal.report.sections import (
    base_parameters_section,
    friction_section,
    learned_section,
    provenance_section,
    recording_labels,
    signals_table,
    torque_blocks,
)

_HEADLINES: dict[Status, str] = {
    "good": "Identified, and the torques can be trusted",
    "care": "Identified, with reservations: read the checks below before relying on it",
    "bad": "Do not rely on these dynamics yet",
    "unknown": "Identified; torques of other motions were not validated",
}


@dataclass(frozen=True, eq=False)
class DynamicsStudy:
    """Identified dynamics, as the folder has them.

    `results` is the document of results.json, `estimate` what estimates.yaml holds; `predictions` are one a recording.
    """

    results: Mapping[str, Any]
    estimate: Estimate
    predictions: Sequence[TorquePrediction]


def held_out(results: Mapping[str, Any]) -> str:
    """The held-out data in words; empty for none."""
    block = results.get("hold_out", {})
    if block.get("logs"):
        return " and ".join(PurePath(log).name for log in block["logs"])
    return f"the last {100 * block['share']:.0f} % of every recording" if block.get("share") else ""


def dynamics_page(study: DynamicsStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    logs = dict(zip(recording_labels(study.predictions), study.predictions, strict=True))
    return Page(
        title=f"{results['robot']}: dynamics report",
        subtitle=f"Inertias and friction from {results['equations']} equations of torque; {results['masked_rows']} rows at standstill "
        f"left out · {len(results['friction_terms'])} friction terms",
        verdict=dynamics_verdict(study),
        sections=[
            Section(
                "torques",
                "Torques: predicted against measured",
                "The torque error on motions outside the fit measures the quality of the model.",
                (
                    *torque_blocks(
                        results["error_percent"], held_out(results), logs, results.get("torque_units")
                    ),
                    signals_table(results["signals"]),
                ),
            ),
            base_parameters_section(results, study.estimate),
            friction_section(results),
            *(
                [learned_section(learned, held_out(results))]
                if (learned := results.get("learned_residual"))
                else []
            ),
            provenance_section(
                results["command"], None, {"identification": results["seconds"]}, results["provenance"]
            ),
        ],
        document=results,
    )


def dynamics_verdict(study: DynamicsStudy) -> Verdict:
    """Torque error, number of determined base parameters, and the verdict."""
    results, checks = study.results, dynamics_checks(study.results)
    error, base = results["error_percent"], results["base_parameters"]
    trust = Trust(checks)
    unseen = error["held_out"] if held_out(results) else None
    shown = error["train"] if unseen is None else unseen
    where = held_out(results) or "the recordings of the fit"
    fitted = f" In the fit it is {significant(error['train'], 3)} %." if unseen is not None else ""
    facts = (
        Fact(
            "How well are torques predicted?",
            significant(shown, 3),
            "% relative error",
            f"On {where}.{fitted}",
        ),
        Fact(
            "How many base parameters are determined?",
            f"{results['rank']} of {len(base)}",
            "",
            f"{len(results['essential_parameters']['parameters'])} of them are essential. With viscous and Coulomb friction and "
            f"offset alone the rank would be {results['structural_rank']}.",
        ),
        trust.fact(),
    )
    sentence = (
        f"The relative error of the predicted torques is {significant(shown, 3)} % on {where}."
        if unseen is not None
        else f"The relative error of the predicted torques is {significant(shown, 3)} % on the recordings of the fit; "
        "the error on other motions is not known."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", checks)


def dynamics_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    return (
        check_unseen_torques(results["error_percent"], held_out(results)).named("held_out", independent=True),
        *([fit.named("torques")] if (fit := check_fit(results["error_percent"]["train"])) else []),
        check_joints(results["error_percent"]["per_joint"]).named("joints"),
        check_base(results).named("base_parameters"),
        check_bodies(results["bodiless_links"]).named("bodies"),
        check_shown(results["remarks"]).named("drive_terms"),
        *([check_weight(faults).named("weight")] if (faults := results.get("weight_faults")) else []),
        *(
            [check_weight_shares(shares).named("weight_shares")]
            if (shares := results.get("weight_shares"))
            else []
        ),
        *(
            [check_external(share).named("external_torques")]
            if (share := results.get("external_share"))
            else []
        ),
    )
