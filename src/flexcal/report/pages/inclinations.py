"""The report of a calibration on inclinometers alone (`flexcal calibrate`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.calibration.verification import MILLIRADIAN, MeasuredTilts, TiltStatistics
from flexcal.estimation import Estimate
from flexcal.report.checks import Trust, inclination_checks
from flexcal.report.layout import Fact, Page, Section, Text, Verdict, sentences, significant
from flexcal.report.pages.calibration import HEADLINES
from flexcal.report.results import IdentifiableParameters
from flexcal.report.sections import (
    identifiability_blocks,
    parameter_figures,
    parameter_table,
    provenance_section,
    tilts_section,
)


@dataclass(frozen=True, eq=False)
class InclinationStudy:
    """A calibration on inclinometers, as its folder has it: `results`, the block of estimates.yaml, and the readings."""

    results: Mapping[str, Any]
    estimate: Estimate
    tilts: MeasuredTilts


def inclination_page(study: InclinationStudy) -> Page:
    """The page before it becomes HTML."""
    results, tilts = study.results, study.tilts
    kept = tuple(results["identifiability"]["selected"]["kept"])
    remarks = results["remarks"]
    sections = [
        *([Section("remarks", "Remarks", "", (Text((), "", sentences(remarks)),))] if remarks else []),
        tilts_section(results["joints"], tilts),
        Section(
            "geometry",
            "Parameters",
            "Parameters that the readings do not determine keep their nominal values, all lengths among them; the parameters that absorb "
            "them are named beside them.",
            (
                *identifiability_blocks(
                    IdentifiableParameters.stored(results["identifiability"]["selected"]), None
                ),
                *parameter_figures(study.estimate, kept),
                parameter_table(study.estimate, kept, None),
            ),
        ),
        provenance_section(results["command"], None, {}, study.estimate.provenance),
    ]
    return Page(
        title=f"{results['robot']}: calibration report",
        subtitle=f"Calibration on {len(tilts.pose)} readings of {', '.join(tilts.sensors)}",
        verdict=_verdict(study),
        sections=sections,
        document=results,
    )


def _verdict(study: InclinationStudy) -> Verdict:
    before, after = (TiltStatistics.of(e) for e in (study.tilts.before, study.tilts.calibrated))
    trust = Trust(inclination_checks(study.results, study.estimate, after))
    was, now = (significant(s.rms / MILLIRADIAN, 3) for s in (before, after))
    return Verdict(
        trust.status,
        HEADLINES[trust.status],
        f"The inclinometers differ from the nominal robot by {was} mrad (root mean square), from the calibrated one by {now} mrad. They "
        "tell how links are turned, and nothing of lengths and places: no accuracy in millimetres follows.",
        (
            Fact(
                "How far off were the joints?",
                was,
                "mrad",
                "Root mean square of the readings, nominal robot.",
            ),
            Fact(
                "How far off are they?", now, "mrad", "Root mean square at the poses of the fit, calibrated."
            ),
            trust.fact(),
        ),
        (),
        "",
        trust.checks,
    )
