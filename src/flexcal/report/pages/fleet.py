"""The page of a fleet (`flexcal fleet`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.report.figures import fleet_errors, trend_courses
from flexcal.report.layout import (
    NOTHING,
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Text,
    Verdict,
    document_millimetres,
    p_value,
    scaled,
    sentences,
    significant,
    worst,
)
from flexcal.report.layout import Block as PageBlock
from flexcal.report.sections import provenance_section

_LISTED = 300
_PANELS = 12
_STATES = {
    "out": "out of tolerance",
    "within": "within",
    "undecided": "too near to tell",
    "not_judged": "not judged",
}


def fleet_page(document: Mapping[str, Any]) -> Page:
    """The page before it becomes HTML, from the document of the verb."""
    counts = document["counts"]
    return Page(
        title="Fleet",
        subtitle=f"{_count(counts['robots'], 'robot')} of {_count(counts['models'], 'model')} in {document['place']}",
        verdict=_verdict(document),
        sections=[
            _robots(document),
            *([_rechecks(document)] if document["counts"]["rechecked"] else []),
            _trends(document),
            _parameters(document),
            *([_problems(document)] if document["problems"] else []),
            provenance_section(document["command"], None, {}, {}),
        ],
        document=document,
    )


def _verdict(document: Mapping[str, Any]) -> Verdict:
    counts = document["counts"]
    checks = _checks(document)
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
            "How many drift?",
            str(counts["drifting"]),
            f"of {len(_with_trends(document))} with trends",
            _named(sorted(r["robot"] for r in document["robots"] if r["drifts"] or r["drifting_parameters"]))
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


def _checks(document: Mapping[str, Any]) -> tuple[Check, ...]:
    counts = document["counts"]
    many = counts["robots"]
    unknown = many - sum(robot["tolerance_mm"] is not None for robot in document["robots"])
    unverified = sum(robot["p90_mm"] is None for robot in document["robots"])
    checks = [
        Check(
            "Has every robot a tolerance?",
            "Yes."
            if not unknown
            else f"{unknown} of {many} have none: give tolerance: in robot.yaml, or --tolerance.",
            "good" if not unknown else "unknown" if unknown == many else "care",
        ),
        Check(
            "Was every robot verified at poses outside its calibration?",
            "Yes." if not unverified else f"{unverified} of {many} were not.",
            "good" if not unverified else "care",
        ),
    ]
    if counts["out"] or counts["within"] or counts["undecided"]:
        checks.append(
            Check(
                "Do all that could be judged keep their tolerance?",
                f"{counts['out']} do not; {counts['undecided']} are too near to tell."
                if counts["out"] or counts["undecided"]
                else "Yes.",
                "bad" if counts["out"] else "care" if counts["undecided"] else "good",
            )
        )
    tested = len(_with_trends(document))
    checks.append(
        Check(
            "Does any robot drift?",
            f"{counts['drifting']} of {tested} with trends do."
            if counts["drifting"]
            else f"No significant trend of the errors of {_count(counts['error_trends_tested'], 'robot')}."
            if counts["error_trends_tested"]
            else "No single parameter has a significant trend, but no robot has three dated verifications of one calibration."
            if tested
            else "No robot has three dated visits.",
            "care" if counts["drifting"] else "good" if counts["error_trends_tested"] else "unknown",
        )
    )
    if counts["rechecked"]:
        checks.append(
            Check(
                "Are the robots as calibrated, by their latest recheck?",
                f"{counts['changed']} of {counts['rechecked']} are not." if counts["changed"] else "Yes.",
                "bad" if counts["changed"] else "good",
            )
        )
    if document["problems"]:
        checks.append(
            Check(
                "Could everything be read?",
                f"No: {len(document['problems'])} files or folders could not be used; they are listed below.",
                "care",
            )
        )
    return tuple(checks)


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
        or robot["drifts"]
        or robot["drifting_parameters"]
        or robot["outlying_parameters"]
        or (robot["recheck"] is not None and (robot["recheck"]["changed"] or robot["recheck"]["alarms"]))
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
    reaches = robot["reaches"]
    outlook = robot["outlook"]
    if robot["drifts"]:
        outlook += f": {_rate(robot['trend'])}"
    if reaches is not None:
        outlook += f"; {reaches['date']} ({reaches['low']} to {reaches['high'] or 'open'})"
    for key, words in (("drifting_parameters", "drifts"), ("outlying_parameters", "differs from the others")):
        if robot[key]:
            outlook += f"; {', '.join(robot[key][:3])}{' and others' if len(robot[key]) > 3 else ''}: {words}"
    if (visit := robot["recheck"]) is not None and (visit["changed"] or visit["alarms"]):
        said = visit["sentence"] if visit["changed"] else f"slow drift of {', '.join(visit['alarms'])}"
        outlook += f"; recheck of {visit['date']}: {said}"
    verified = robot["p90_mm"] is not None
    return (
        robot["robot"],
        f"{document_millimetres(robot['p90_mm'])} ± {document_millimetres(robot['p90_std_mm'])}"
        if verified
        else NOTHING,
        document_millimetres(robot["tolerance_mm"]) + ("*" if robot["tolerance_from"] == "option" else ""),
        _STATES[robot["state"]] if robot["state"] != "not_judged" else f"not judged: {robot['reason']}",
        outlook,
        robot["verified"] or ("no date" if verified else NOTHING),
        robot["model"],
    )


def _trends(document: Mapping[str, Any]) -> Section:
    counts, level = document["counts"], document["level"]
    drifting = [robot for robot in document["robots"] if robot["drifts"]]
    parameters = document["parameter_drifts"]
    words = (
        f"Trends need three dated visits or more. Tested: the errors of {counts['error_trends_tested']} robots since their latest "
        f"calibration, and {counts['parameter_trends_tested']} parameters of {counts['robots_with_parameter_trends']} robots over their "
        "calibrations. "
        f"P-values are corrected for the number of tests (Holm): if nothing drifts, any robot is named for its errors in "
        f"{100 * level:.0f} % of fleets at most, and in as many for its parameters."
    )
    blocks: list[PageBlock] = []
    if drifting:
        shown = sorted(drifting, key=lambda r: r["trend"]["adjusted_probability"])[:_PANELS]
        blocks.append(
            FigureBlock(
                "figure-trends",
                "Errors that changed over time",
                trend_courses([r["robot"] for r in shown], [r["trend"] for r in shown]),
                f"P90 with 95 % intervals, mm, and the fitted line{'' if len(shown) == len(drifting) else f'; the {_PANELS} clearest'}.",
                f"Courses of the P90 of {len(shown)} robots over time.",
            )
        )
    if parameters:
        shown = parameters[:_PANELS]
        blocks.append(
            Table(
                "table-drifts",
                "Parameters that changed over time",
                (
                    "robot",
                    "parameter",
                    "visits",
                    "from",
                    "to",
                    "change per year, 95 % interval",
                    "unit",
                    "p, corrected",
                ),
                tuple(_drift_row(item) for item in parameters[:_LISTED]),
                text_columns=(1, 3, 4, 6),
            )
        )
        blocks.append(
            FigureBlock(
                "figure-parameters",
                "Parameters that changed over time",
                trend_courses([f"{p['robot']}: {p['name']}" for p in shown], shown),
                "Estimates with 95 % intervals, and the fitted line.",
                f"Courses of {len(shown)} parameters over time.",
            )
        )
    if not blocks:
        blocks.append(
            Text(
                (
                    "No significant trend."
                    if counts["error_trends_tested"] or counts["parameter_trends_tested"]
                    else "No robot has three dated visits, so nothing can be said of drift.",
                )
            )
        )
    return Section("trends", "Drift", words, tuple(blocks))


def _rechecks(document: Mapping[str, Any]) -> Section:
    visited = [robot for robot in document["robots"] if robot["recheck"] is not None]
    found = [r for r in visited if r["recheck"]["verdict"] != "as_calibrated" or r["recheck"]["alarms"]]
    found.sort(key=lambda robot: robot["recheck"]["probability"])
    lead = (
        f"The latest recheck of {_count(len(visited), 'robot')}. Alone, each is called changed in 1 % of visits where it is not; a change "
        f"is certain here where it is significant after correction for the number of robots (Holm, {100 * document['level']:.0f} %)."
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


def _parameters(document: Mapping[str, Any]) -> Section:
    spreads = document["parameters"]
    lead = (
        "Latest estimates of robots of one model. The spread is the standard deviation between robots, without the outlying ones and with "
        "the uncertainty of the measurements removed (random effects, Paule and Mandel); 0 means that the measurements explain all "
        "differences. Parameters of instrument and tool, those tied to them, and those that a prior holds are left out. If all robots of a "
        f"model are of one normal distribution, any is named in {100 * document['level']:.0f} % of models at most."
    )
    if not spreads:
        return Section(
            "parameters",
            "Robots of one model",
            lead,
            (Text(("Three robots of one model with a common parameter are needed.",)),),
        )
    outlying = [(spread, item) for spread in spreads for item in spread["outliers"]]
    blocks: list[PageBlock] = []
    if outlying:
        blocks.append(
            Table(
                "table-outlying",
                "Robots that differ from the others",
                (
                    "robot",
                    "model",
                    "parameter",
                    "value ± std",
                    "the others, mean ± spread",
                    "unit",
                    "p, corrected",
                ),
                tuple(_outlier_row(spread, item) for spread, item in outlying),
                text_columns=(1, 2, 5),
            )
        )
    else:
        blocks.append(Text(("No robot differs significantly from the others of its model.",)))
    blocks.append(
        Table(
            "table-spread",
            "Spread over the robots of a model",
            (
                "parameter",
                "model",
                "robots",
                "mean ± std",
                "spread",
                "95 % interval",
                "measurement's std",
                "unit",
            ),
            tuple(_spread_row(spread) for spread in spreads),
            text_columns=(1, 7),
        )
    )
    return Section("parameters", "Robots of one model", lead, tuple(blocks))


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


def _drift_row(item: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = scaled(item["unit"])
    rate, low, high = (significant(factor * item[key], 3) for key in ("per_year", "low", "high"))
    return (
        item["robot"],
        item["name"],
        str(item["visits"]),
        item["first"],
        item["last"],
        f"{rate} ({low} to {high})",
        unit,
        p_value(item["adjusted_probability"]),
    )


def _outlier_row(spread: Mapping[str, Any], item: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = scaled(spread["unit"])
    value, std, mean, width = (
        significant(factor * number, 3)
        for number in (item["value"], item["std"], spread["mean"], spread["spread"])
    )
    return (
        item["robot"],
        spread["model"],
        spread["name"],
        f"{value} ± {std}",
        f"{mean} ± {width}",
        unit,
        p_value(item["adjusted_probability"]),
    )


def _spread_row(spread: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = scaled(spread["unit"])
    mean, mean_std, width, low, high, std = (
        significant(factor * spread[key], 3)
        for key in ("mean", "mean_std", "spread", "spread_low", "spread_high", "measurement_std")
    )
    return (
        spread["name"],
        spread["model"],
        str(spread["robots"]),
        f"{mean} ± {mean_std}",
        width,
        "below the measurements'" if spread["spread_high"] == 0 else f"{low} to {high}",
        std,
        unit,
    )


def _rate(trend: Mapping[str, Any]) -> str:
    rate, low, high = (significant(trend[key], 2) for key in ("per_year", "low", "high"))
    return f"{rate} mm a year ({low} to {high})"


def _with_trends(document: Mapping[str, Any]) -> Sequence[str]:
    return [
        robot["robot"]
        for robot in document["robots"]
        if robot["trend"] is not None or robot["parameter_trends"]
    ]


def _named(names: Sequence[str]) -> str:
    return (
        ""
        if not names
        else ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "") + "."
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
