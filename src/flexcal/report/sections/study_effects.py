"""Effects of the options of a study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.figures import level_distributions
from flexcal.report.layout import (
    NOTHING,
    FigureBlock,
    Section,
    Table,
    Text,
    document_millimetres,
    p_value,
    percent,
)
from flexcal.report.results import StudyTable, effect_sentence, study_level_rows


def effects_section(results: Mapping[str, Any], table: StudyTable) -> Section:
    """Shares of the variance between tasks, and errors by the values of every option, from `effects` of results.json."""
    blocks = []
    shares = tuple(
        (
            item["option"],
            percent(item["share"]) if item["share"] is not None else NOTHING,
            p_value(item["p"]) if item["p"] is not None else NOTHING,
        )
        for item in results["effects"]
    )
    words = (
        "Variance of the logarithm of a task's 90th percentile, explained by the levels of an option alone (ε², adjusted for chance; an "
        "option without effect has about 0). The rest are seeds, other options, and interactions. p is the probability that an option "
        "without effect explains as much, from the scatter between seeds and between draws; there is none where these are too few."
    )
    told = tuple(f"{effect_sentence(item)}." for item in results["effects"])
    blocks.append(Text(told))
    blocks.append(
        Table("table-shares", "Share of the variance between tasks", ("option", "share", "p"), shares)
    )
    blocks.append(Text((words,)))
    if any(item["option"].startswith("cell.") for item in results["effects"]):
        blocks.append(
            Text(
                (
                    "Values of the cell's settings are in SI units, as in cell.yaml: lengths in m, angles in rad.",
                )
            )
        )
    values = table.numbers(f"{table.error}.p90_mm")
    known = results["has_truth"]
    columns = ("value", "tasks", "median / mm", *(("coverage",) if known else ()))
    for number, item in enumerate((item for item in results["effects"] if item["levels"]), 1):
        option = item["option"]
        rows = tuple(
            (
                str(level["value"]),
                str(level["tasks"]),
                document_millimetres(level["median_mm"]),
                *((percent(level["coverage"]),) if known else ()),
            )
            for level in item["levels"]
        )
        boxes = [(str(label), values[own]) for label, own in study_level_rows(table, f"option.{option}")]
        blocks += [
            Table(f"table-option-{number}", option, columns, rows),
            FigureBlock(
                f"figure-option-{number}",
                f"Errors by {option}",
                level_distributions(boxes),
                "Box: quartiles; whiskers: 95 % of the tasks.",
                f"Boxes of the errors by {option}.",
            ),
        ]
    return Section("effects", "What drives the error", "", tuple(blocks))
