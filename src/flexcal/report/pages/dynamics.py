"""The report of identified dynamics (`flexcal identify dynamics`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.estimation import Estimate
from flexcal.report.checks import Trust, dynamics_checks, held_out_recordings
from flexcal.report.layout import Fact, Page, Section, Status, Verdict, significant
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
                        results["error_percent"],
                        held_out_recordings(results),
                        logs,
                        results.get("torque_units"),
                    ),
                    signals_table(results["signals"]),
                ),
            ),
            base_parameters_section(results, study.estimate),
            friction_section(results),
            *(
                [learned_section(learned, held_out_recordings(results))]
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
    unseen = error["held_out"] if held_out_recordings(results) else None
    shown = error["train"] if unseen is None else unseen
    where = held_out_recordings(results) or "the recordings of the fit"
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
