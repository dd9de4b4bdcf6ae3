"""The report of measured frequency responses (`flexcal identify response`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.frequency.periodic import FrequencyResponse
from flexcal.report.checks import Trust, limit_of, response_checks, worst_pose
from flexcal.report.layout import NOTHING, Fact, Page, Section, Status, Table, Verdict, percent
from flexcal.report.results import relative_to_diagonal
from flexcal.report.sections import levels_block, provenance_section
from flexcal.units import DEGREE

_HEADLINES: dict[Status, str] = {
    "good": "Frequency responses measured, and springs can be fitted to them",
    "care": "Frequency responses measured, with reservations: read the checks below before fitting springs to them",
    "bad": "Do not fit springs to these responses yet",
    "unknown": "Frequency responses measured; whether they can be trusted cannot be judged",
}


@dataclass(frozen=True, eq=False)
class ResponseStudy:
    """Measured responses as the folder has them: the document of results.json, and its `responses` in the same order."""

    results: Mapping[str, Any]
    responses: Sequence[FrequencyResponse]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the poses in the report."""
        return tuple(f"Pose {response.pose + 1}" for response in self.responses)


def response_page(study: ResponseStudy) -> Page:
    """The page before it becomes HTML."""
    results, first = study.results, study.responses[0]
    poses = "pose" if len(study.responses) == 1 else "poses"
    return Page(
        title=f"{results['robot']}: frequency response report",
        subtitle=f"From motor torque to motor acceleration of {', '.join(first.joints)} in {len(study.responses)} {poses}",
        verdict=_verdict(study),
        sections=(
            Section(
                "responses",
                "Frequency responses",
                "",
                (
                    _table(study),
                    levels_block("figure-levels", "Measured responses", study.responses, study.labels),
                ),
            ),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


def _verdict(study: ResponseStudy) -> Verdict:
    entries = study.results["responses"]
    trust = Trust(response_checks(study.results, study.responses))
    least, limit = worst_pose(entries), limit_of(entries)
    advice = (
        "More realisations reduce it, more periods do not."
        if limit == "distortion"
        else "More periods or larger torques reduce it."
    )
    facts = (
        Fact(
            "How uncertain is the response?",
            percent(least["relative_std"]),
            "1σ",
            f"At the median line of the diagonal in pose {least['pose']}, the worst.",
        ),
        Fact(
            "What limits it?",
            limit.capitalize(),
            "",
            f"The part due to noise is {percent(least['relative_noise_std'])}. {advice}",
        ),
        trust.fact(),
    )
    low, high = (function(entry[key] for entry in entries) for function, key in _BAND)
    where = "1 pose" if len(entries) == 1 else f"{len(entries)} poses"
    sentence = (
        f"The motors were excited in {where}, at {least['lines']} frequencies from {low:g} to {high:g} Hz; the "
        "resonances of the springs must lie between them."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", trust.checks)


_BAND = (min, "lowest_hz"), (max, "highest_hz")


def _table(study: ResponseStudy) -> Table:
    entries = study.results["responses"]
    with_odd = any(entry["odd_distortion"] for entry in entries)
    rows = []
    for label, entry, response in zip(study.labels, entries, study.responses, strict=True):
        distortion = float(np.median(relative_to_diagonal(response.distortion_std, response.response)))
        angles = ", ".join(f"{q / DEGREE:z.1f}" for q in response.q_mean).replace("-", "−")
        odd = percent(max(entry["odd_distortion"])) if entry["odd_distortion"] else NOTHING
        rows.append(
            (
                label,
                f"{angles}°",
                "as declared" if response.payload is None else f"{response.payload:g} kg",
                str(entry["lines"]),
                f"{entry['lowest_hz']:g} to {entry['highest_hz']:g}",
                percent(entry["relative_std"]),
                percent(entry["relative_noise_std"]),
                percent(distortion),
                f"{entry['degrees_of_freedom']:.0f}",
                *((odd,) if with_odd else ()),
            )
        )
    columns = ("pose", "mean joint position", "payload", "lines", "band / Hz", "1σ", "noise")
    columns += ("distortion", "degrees of freedom", *(("odd distortion",) if with_odd else ()))
    return Table(
        "table-responses",
        "Uncertainty by pose",
        columns,
        tuple(rows),
        "1σ is the relative standard deviation of the mean, at the median line of the diagonal; noise and distortion are its parts, whose "
        f"squares add up. Realisations were averaged by the method '{entries[0]['method'].replace('_', '-')}'."
        + (
            " Odd distortion is what lines that were left out show, over the excited acceleration of the axis where it is largest."
            if with_odd
            else ""
        ),
        text_columns=(1,),
    )
