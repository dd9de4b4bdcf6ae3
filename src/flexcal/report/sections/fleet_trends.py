"""Errors and parameters of a fleet's robots that changed over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.calibration.comparison import GROWTH
from flexcal.report.figures import trend_courses
from flexcal.report.layout import (
    NOTHING,
    Block,
    FigureBlock,
    Section,
    Table,
    Text,
    counted,
    p_value,
    scaled,
    significant,
)

_LISTED = 300
_PANELS = 12


def trends_section(document: Mapping[str, Any]) -> Section:
    """Significant trends, from the document of the verb."""
    counts, level = document["counts"], document["level"]
    drifting = [robot for robot in document["robots"] if robot["drifts"]]
    parameters = document["parameter_drifts"]
    words = (
        f"Trends need three dated visits or more. Tested: the errors of {counts['error_trends_tested']} robots since their latest "
        f"calibration, and {counts['parameter_trends_tested']} parameters of {counts['robots_with_parameter_trends']} robots over their "
        "calibrations; and the geometry as a whole, by the movement of the tool at common poses that all parameters together make, of "
        f"{counted(counts['geometry_trends_tested'], 'robot')}. "
        f"P-values are corrected for the number of tests (Holm): if nothing drifts, any robot is named for its errors in "
        f"{100 * level:.0f} % of fleets at most, and in as many for its single parameters. For the geometry as a whole it may be more "
        "often after three visits, where values scatter more than their covariances tell: measure again what is named. "
        "The geometry is tested for a jump between any two calibrations that follow each other too, from three on; what explains a robot "
        "better, trend or jump, is named. flexcal report --compare compares two calibrations."
    )
    blocks: list[Block] = []
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
    if document["geometry_drifts"]:
        blocks.append(_geometry_table(document["geometry_drifts"]))
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
                    if counts["error_trends_tested"]
                    or counts["parameter_trends_tested"]
                    or counts["geometry_trends_tested"]
                    else "No robot has three dated visits, so nothing can be said of drift.",
                )
            )
        )
    return Section("trends", "Drift", words, tuple(blocks))


def _geometry_table(drifts: Sequence[Mapping[str, Any]]) -> Table:
    return Table(
        "table-geometry",
        "Robots whose geometry as a whole drifted or jumped",
        ("robot", "visits", "from", "to", "what changed", "per year", "p, corrected"),
        tuple(
            (
                item["robot"],
                str(item["visits"]),
                item["first"],
                item["last"],
                item["sentence"],
                "; ".join(_yearly(cause) for cause in item["explanations"]) or NOTHING,
                p_value(item["adjusted_probability"]),
            )
            for item in drifts[:_LISTED]
        ),
        note="Changes of parameters are the simplest that explain the movement of the tool. What another place of the base, of the "
        "instrument or of the reflector on the tool looks like is left out.",
        text_columns=(2, 3, 4, 5),
    )


def _yearly(cause: Mapping[str, Any]) -> str:
    factor, unit = scaled(cause["unit"])
    if cause["per_year"] is None:
        return NOTHING
    rate, std = (significant(factor * cause[key], 3) for key in ("per_year", "per_year_std"))
    name = "all lengths" if cause["name"] == GROWTH else cause["name"]
    return f"{name} {rate} ± {std} {unit}"


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
