"""The page of a fleet (`flexcal fleet`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.calibration.recheck import FALSE_ALARM
from flexcal.report.checks import fleet_checks
from flexcal.report.figures import fleet_errors
from flexcal.report.layout import (
    NOTHING,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Text,
    Verdict,
    counted,
    document_millimetres,
    p_value,
    sentences,
    significant,
    worst,
)
from flexcal.report.layout import Block as PageBlock
from flexcal.report.results import is_drifting, tolerance_kept, with_trends
from flexcal.report.sections import parameter_spreads_section, provenance_section, trends_section

_LISTED = 300


def fleet_page(document: Mapping[str, Any]) -> Page:
    """The page before it becomes HTML, from the document of the verb."""
    counts = document["counts"]
    return Page(
        title="Fleet",
        subtitle=f"{counted(counts['robots'], 'robot')} of {counted(counts['models'], 'model')} in {document['place']}",
        verdict=_verdict(document),
        sections=[
            _robots(document),
            *([_rechecks(document)] if document["counts"]["rechecked"] else []),
            trends_section(document),
            parameter_spreads_section(document),
            *([_problems(document)] if document["problems"] else []),
            provenance_section(document["command"], None, {}, {}),
        ],
        document=document,
    )


def _verdict(document: Mapping[str, Any]) -> Verdict:
    counts = document["counts"]
    checks = fleet_checks(document)
    out = [robot["robot"] for robot in document["robots"] if robot["state"] == "out"]
    soon = [robot for robot in document["robots"] if robot["reaches"] is not None]
    facts = (
        Fact(
            "How many are out of tolerance?",
            str(counts["out"]) if counts["robots"] > counts["not_judged"] else NOTHING,
            f"of {counts['robots'] - counts['not_judged']} judged"
            if counts["robots"] > counts["not_judged"]
            else "",
            _named(out) or "None by more than the uncertainty of its P90."
            if counts["robots"] > counts["not_judged"]
            else "No robot has both a tolerance and a verification.",
            None if counts["robots"] == counts["not_judged"] else "bad" if out else "good",
        ),
        Fact(
            "How many drift or changed?",
            str(counts["drifting"]),
            f"of {len(with_trends(document))} tested",
            _named(sorted(robot["robot"] for robot in document["robots"] if is_drifting(robot)))
            or "None significantly, after correction for the number of tests.",
        ),
        Fact(
            "Which reach their tolerance, and when?",
            str(len(soon)) if soon else "none",
            "",
            "; ".join(f"{r['robot']} by {r['reaches']['date']}" for r in soon[:3])
            + ("; …" if len(soon) > 3 else "")
            if soon
            else "No trend says so.",
        ),
    )
    status = worst(checks)
    if status == "good" and counts["robots"] == counts["not_judged"]:
        status = "unknown"
    return Verdict(
        status, document["headline"], " ".join(sentences(document["remarks"])), facts, (), "", checks
    )


def _robots(document: Mapping[str, Any]) -> Section:
    robots = sorted(
        document["robots"], key=lambda r: (not _needs_attention(r), -(r["p90_mm"] or 0), r["robot"])
    )
    attention = [robot for robot in robots if _needs_attention(robot)]
    verified = [robot for robot in document["robots"] if robot["p90_mm"] is not None]
    blocks: list[PageBlock] = []
    if verified:
        blocks.append(
            FigureBlock(
                "figure-errors",
                "Errors of all robots at their latest verification",
                fleet_errors(verified),
                "Bars are 95 % intervals of the P90, dashes the tolerances.",
                f"P90 of {len(verified)} robots in the order of its size.",
            )
        )
    if attention:
        words = "Robots out of tolerance or too near to tell, and those that drift or differ from the others"
        blocks.append(_robot_table("table-attention", words, attention))
    words = "All robots" if len(robots) <= _LISTED else f"{_LISTED} of {len(robots)} robots"
    blocks.append(_robot_table("table-robots", words, robots[:_LISTED], folded=bool(attention)))
    return Section(
        "robots",
        "Accuracy",
        "The P90 of the distances between measured and predicted points at the latest verification outside the fit. A robot is out of "
        "tolerance, or within, only where 1.645 standard deviations of the P90 do not matter (ISO 14253-1): a robot that keeps its "
        "tolerance is called out of it in 5 % of verifications at most.",
        tuple(blocks),
    )


def _needs_attention(robot: Mapping[str, Any]) -> bool:
    return bool(
        robot["state"] in ("out", "undecided")
        or is_drifting(robot)
        or robot["outlying_parameters"]
        or robot["not_tested"] is not None
    )


def _robot_table(
    id: str, caption: str, robots: Sequence[Mapping[str, Any]], *, folded: bool = False
) -> Table:
    columns = ("robot", "P90 ± std / mm", "tolerance / mm", "tolerance kept?", "outlook", "verified", "model")
    given = any(robot["tolerance_from"] == "option" for robot in robots)
    note = "A tolerance with * is that of --tolerance, others are those of robot.yaml." if given else ""
    rows = tuple(_robot_row(robot) for robot in robots)
    return Table(id, caption, columns, rows, note=note, text_columns=(3, 4, 5, 6), folded=folded)


def _robot_row(robot: Mapping[str, Any]) -> tuple[str, ...]:
    outlook = robot["outlook"]
    if robot["drifts"]:
        outlook += f"; errors by {_rate(robot['trend'])}"
    if names := robot["outlying_parameters"]:
        outlook += (
            f"; {', '.join(names[:3])}{' and others' if len(names) > 3 else ''}: differs from the others"
        )
    verified = robot["p90_mm"] is not None
    return (
        robot["robot"],
        f"{document_millimetres(robot['p90_mm'])} ± {document_millimetres(robot['p90_std_mm'])}"
        if verified
        else NOTHING,
        document_millimetres(robot["tolerance_mm"]) + ("*" if robot["tolerance_from"] == "option" else ""),
        tolerance_kept(robot),
        outlook,
        robot["verified"] or ("no date" if verified else NOTHING),
        robot["model"],
    )


def _rechecks(document: Mapping[str, Any]) -> Section:
    visited = [robot for robot in document["robots"] if robot["recheck"] is not None]
    found = [r for r in visited if r["recheck"]["verdict"] != "as_calibrated" or r["recheck"]["alarms"]]
    found.sort(key=lambda robot: robot["recheck"]["probability"])
    lead = (
        f"The latest recheck of {counted(len(visited), 'robot')}. Alone, each is called changed in {100 * FALSE_ALARM:g} % of visits where "
        "it is not; a change is certain here where it is significant after correction for the number of robots (Holm, "
        f"{100 * document['level']:.0f} %)."
    )
    if not found:
        return Section("rechecks", "Rechecks", lead, (Text(("All are as calibrated.",)),))
    table = Table(
        "table-rechecks",
        "Robots that were not as calibrated, or whose cumulative sums gave an alarm",
        ("robot", "visit", "p", "p, corrected", "what the recheck said", "slow drift of"),
        tuple(
            (
                robot["robot"],
                robot["recheck"]["date"],
                p_value(robot["recheck"]["probability"]),
                p_value(robot["recheck"]["adjusted_probability"]),
                robot["recheck"]["sentence"],
                ", ".join(robot["recheck"]["alarms"]) or NOTHING,
            )
            for robot in found
        ),
        text_columns=(1, 4, 5),
    )
    return Section("rechecks", "Rechecks", lead, (table,))


def _problems(document: Mapping[str, Any]) -> Section:
    rows = tuple((problem["place"], problem["sentence"]) for problem in document["problems"])
    return Section(
        "problems",
        "What could not be used",
        "All else on this page is without these.",
        (
            Table(
                "table-problems",
                "Files and folders with problems",
                ("where", "what"),
                rows,
                text_columns=(1,),
            ),
        ),
    )


def _rate(trend: Mapping[str, Any]) -> str:
    rate, low, high = (significant(trend[key], 2) for key in ("per_year", "low", "high"))
    return f"{rate} mm a year ({low} to {high})"


def _named(names: Sequence[str]) -> str:
    return (
        ""
        if not names
        else ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "") + "."
    )
