"""The report of a recheck of a calibrated robot (`flexcal recheck`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.calibration.recheck import FALSE_ALARM
from flexcal.report.figures import cumulative_sums, visit_errors
from flexcal.report.layout import (
    NOTHING,
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    counted,
    document_millimetres,
    significant,
)
from flexcal.report.sections import provenance_section

_HEADLINES = {
    "as_calibrated": "As calibrated",
    "as_at_reference": "As at the reference visit, which differs from the calibration",
    "joint_shifted": "A joint shifted",
    "tool_bumped": "Tool bumped",
    "thermal_growth": "Thermal growth",
    "payload_changed": "Another payload",
    "joint_softer": "A joint yields more or less",
    "gear_worn": "Play in a gear",
    "instrument_moved": "The instrument moved, the robot is as calibrated",
    "wrong_reading": "Readings disagree: mend or repeat them",
    "noisier_readings": "The readings scatter more than they did: check the instrument",
    "readings_drift": "Instrument or robot drifted during the visit: measure again",
    "ambiguous": "Something changed, in one of several ways",
    "recalibrate": "Recalibrate",
}
_MEASURE_AGAIN = ("wrong_reading", "noisier_readings", "readings_drift")
"""Verdicts on the measurement rather than the robot."""
_COMPARED = {
    "calibration": "the calibrated model, whose own errors are part of what is expected",
    "reference": "a reference visit to the same poses, so that errors of the model cancel",
}
_NOISE = {
    "calibration": "as the calibration found it",
    "repeats": "of repeated readings of the same poses",
}


@dataclass(frozen=True, eq=False)
class RecheckStudy:
    """Recheck of the robot called `name`, and `results` as the verb prints them."""

    name: str
    results: Mapping[str, Any]


def recheck_page(study: RecheckStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    block = results["recheck"]
    found = [j["found_95_percent"] for j in block["power"]["joints"].values()]
    least = None if not found or any(v is None for v in found) else max(found)
    facts = (
        Fact(
            "Is it as calibrated?",
            _as_calibrated(results),
            "",
            f"Chance makes errors as conspicuous with p = {significant(block['probability'], 2)}; below {block['false_alarm']:g} "
            f"something changed. That is so by chance in {100 * block['false_alarm']:.1g} % of visits, and sums over the visits add "
            f"{100 * (FALSE_ALARM - block['false_alarm']):.1g} %: false alarms are {100 * FALSE_ALARM:g} % in all.",
            _status(results),
        ),
        Fact(
            "How far is the tool off now?",
            _tool_off(block),
            "mm",
            f"{_since(block)}{'By what it was. ' if len(block['suspects']) > 1 else ''}At 95 % of the poses; "
            f"{document_millimetres(block['expected_mm'])} mm (rms) are expected of the calibrated robot.",
        ),
        Fact(
            "What would have been found?",
            NOTHING if least is None else f"{least * 1e3:.3f}",
            _shift_unit(block),
            "Shift of any joint that is found with 95 %; joint by joint below.",
        ),
    )
    verdict = Verdict(
        _status(results),
        _headline(results),
        _sentence(results["sentence"]),
        facts,
        (),
        "",
        _checks(results),
    )
    return Page(
        title=f"{study.name}: recheck",
        subtitle=f"{block['poses']} poses and points, compared with {_COMPARED[block['compared']]}",
        verdict=verdict,
        sections=[
            _visit_section(results),
            *([_suspects_section(block)] if block["suspects"] else []),
            _power_section(block),
            *([_drift_section(results["drift"])] if results["drift"]["sums"] else []),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ],
        document=results,
    )


def _headline(results: Mapping[str, Any]) -> str:
    told = _change_headline(results)
    # what stands elsewhere is not hidden behind what changed beside it
    if results["recheck"]["instrument"] == "evident" and results["recheck"]["verdict"] != "instrument_moved":
        return f"The instrument moved, and beside that: {told[:1].lower()}{told[1:]}"
    return told


def _change_headline(results: Mapping[str, Any]) -> str:
    block, drift = results["recheck"], results["drift"]
    courses = {item["course"] for item in drift["courses"]}
    if block["verdict"] in (
        "joint_shifted",
        "tool_bumped",
        "thermal_growth",
        "payload_changed",
        "joint_softer",
        "gear_worn",
        "ambiguous",
    ):
        if courses == {"drift"}:
            return "It drifts from visit to visit"
        if block["reference_against_calibration"] is not None:
            return f"Since the reference visit: {_HEADLINES[block['verdict']].lower()}"
    return _HEADLINES[block["verdict"]]


def _as_calibrated(results: Mapping[str, Any]) -> str:
    block = results["recheck"]
    if block["verdict"] in _MEASURE_AGAIN:
        return "Measure again"
    if block["verdict"] == "as_at_reference":
        return "As at the reference"
    return {"good": "Yes", "care": "As far as seen"}.get(_status(results), "No")


def _since(block: Mapping[str, Any]) -> str:
    """From when the displacement of the tool counts, where the reference visit was not as calibrated itself."""
    if block["reference_against_calibration"] is None or block["verdict"] == "as_at_reference":
        return ""
    return "Since the reference visit, which differed from the calibration. "


def _shift_unit(block: Mapping[str, Any]) -> str:
    """Thousandth of the unit of the joints' shifts."""
    units = {joint["unit"] for joint in block["power"]["joints"].values()}
    return "mm" if units == {"m"} else "mrad or mm" if "m" in units else "mrad"


def _tool_off(block: Mapping[str, Any]) -> str:
    """Displacement of the tool by the change that is named, or by the changes that may be."""
    off = [suspect["tool_mm"]["p95"] for suspect in block["suspects"]]
    told = list(dict.fromkeys(document_millimetres(value) for value in sorted(off)))
    return f"{told[0]} to {told[-1]}" if len(told) > 1 else told[0] if told else document_millimetres(None)


def _status(results: Mapping[str, Any]) -> Status:
    block = results["recheck"]
    if block["verdict"] == "as_calibrated":
        fitted = block.get("fitted") and block["compared"] == "calibration"
        return "care" if fitted or results["drift"]["alarms"] else "good"
    return "care" if block["verdict"] in ("instrument_moved", "as_at_reference", *_MEASURE_AGAIN) else "bad"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    block, drift = results["recheck"], results["drift"]
    lost = [name for name, joint in block["power"]["joints"].items() if joint["found_95_percent"] is None]
    measured = "care" if block["verdict"] in _MEASURE_AGAIN or block["scatter"] is not None else "good"
    several = len(block["suspects"])
    return (
        Check(
            "Are the readings as good as they were?",
            "No: see the sentence above." if measured == "care" else "Yes: nothing speaks for worse ones.",
            measured,
        ),
        Check(
            "Is it told what changed?",
            f"Not alone: {several} changes explain the readings about as well."
            if several > 1
            else _cause(block),
            "care" if several > 1 or block["verdict"] in ("recalibrate", "noisier_readings") else "good",
        ),
        Check(
            "Does the visit see every joint?",
            f"Not {', '.join(lost)}: these points do not show their shift"
            + (
                ", as it looks just like another place of the instrument."
                if block["instrument"] != "known"
                else "."
            )
            if lost
            else "Yes.",
            "care" if lost else "good",
        ),
        Check(
            "Do visits before tell slow drifts?",
            f"{counted(len(drift['visits']), 'visit')} so far"
            + (
                f": {' or '.join(drift['alarms'])} changed over them."
                if drift["alarms"]
                else ", nothing beyond chance."
            ),
            "good" if len(drift["visits"]) > 1 else "unknown",
        ),
    )


def _cause(block: Mapping[str, Any]) -> str:
    if block["suspects"]:
        return "Yes: every other single change is excluded."
    if block["verdict"] in ("recalibrate", "noisier_readings"):
        return "No: no single change explains the readings."
    return "Nothing beyond chance changed."


def _visit_section(results: Mapping[str, Any]) -> Section:
    block = results["recheck"]
    figure = FigureBlock(
        "figure-visit",
        "Pose by pose",
        visit_errors(block["each"]),
        "Distance between measured and expected point, beside what scatter, and against the calibration its own errors, let expect.",
        "Measured and expected distances of every pose.",
    )
    lead = f"The scatter is {_NOISE[block['noise']]}."
    if block["reference"] is not None:
        lead += f" The reference visit is that of {block['reference']}."
    return Section(
        "visit", "The visit", lead, (figure, Text(tuple(_sentence(remark) for remark in results["remarks"])))
    )


def _suspects_section(block: Mapping[str, Any]) -> Section:
    rows = tuple(
        (
            item["words"],
            significant(item["remainder"], 2),
            document_millimetres(item["tool_mm"]["mean"]),
            document_millimetres(item["tool_mm"]["p95"]),
            ", ".join(f"{value:.2f}" for value in item["tool_mm"]["at"]),
        )
        for item in block["suspects"]
    )
    table = Table(
        "table-suspects",
        "Changes that explain the errors about equally well, the most likely first",
        ("change (95 % interval)", "p of the rest", "tool off: mean / mm", "p95 / mm", "most at q / rad, m"),
        rows,
        note="Each as if it alone had happened. p of the rest: probability that chance leaves what the change does not explain.",
        text_columns=(4,),
    )
    return Section("suspects", "What changed", "", (table,))


def _power_section(block: Mapping[str, Any]) -> Section:
    rows = tuple(
        (
            name,
            *(
                "not seen" if joint[key] is None else f"{joint[key] * 1e3:.4f}"
                for key in ("std", "found_95_percent", "least_possible")
            ),
            f"{100 * joint['power']:.0f} %",
        )
        for name, joint in block["power"]["joints"].items()
    )
    table = Table(
        "table-power",
        f"Shifts of single joints that this visit finds, {_shift_unit(block)}",
        (
            "joint",
            "std",
            "found with 95 %",
            "least that any test finds",
            f"{block['power']['shift'] * 1e3:g}: found with",
        ),
        rows,
        note=f"At {100 * block['false_alarm']:.1g} % false alarms of the visit. The last but one column is that of the best test for this "
        "joint alone (Neyman and "
        "Pearson), by the Cramér-Rao bound of these poses and this noise: no evaluation of the same measurements finds less.",
    )
    return Section("power", "What would have been found", "", (table,))


def _drift_section(drift: Mapping[str, Any]) -> Section:
    figure = FigureBlock(
        "figure-drift",
        "Cumulative sums over the visits",
        cumulative_sums(drift),
        "Every sum adds up what a visit differs from those before it; visits that show a change on their own do not count, and their "
        f"verdict says it. Beyond the dashed limits (± {drift['limit']:.2f}) a joint drifts; "
        f"false alarms of all sums together are {drift['average_run']:.0f} visits apart on average, or more.",
        "Upward and downward cumulative sums of every joint against the visits.",
    )
    return Section("drift", "Slow drifts", "", (figure,))
