"""The friction terms selected by cross-validation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import NOTHING, Block, Section, Table, Text, significant

LONG = 12
"""Number of rows from which the table of trials is folded."""


def friction_section(results: Mapping[str, Any]) -> Section:
    """The terms in the model and, where some were chosen from the recordings, everything that was tried."""
    terms, shapes, tried = results["friction_terms"], results["friction_shapes"], results["friction_tried"]
    labels = [f"{name} ({shapes[name]})" if name in shapes else name for name in terms]
    blocks: list[Block] = [Text((f"In the model: {_words(labels)}.",))]
    if tried:
        fitting = [k for k, row in enumerate(tried) if set(row["terms"]) <= set(labels)]
        taken = max(fitting, key=lambda k: len(tried[k]["terms"]))
        rows = tuple(
            (
                _words(row["terms"]) or "classic terms only",
                significant(row["cross_validation_percent"], 4),
                NOTHING if row.get("p_value") is None else significant(row["p_value"], 2),
            )
            for row in tried
        )
        rule = (
            "a further term has to reduce the error by 1 % and to be significant, with a p-value of 0.05 at most (times the number of "
            "candidates)"
            if not tried[0]["terms"]
            else "robot.yaml names the terms, and each has the shape with the smallest error"
        )
        blocks.append(
            Table(
                "table-friction",
                "Friction terms that were tried, in order",
                ("terms", "cross-validated error / %", "p-value of the last term"),
                rows,
                f"Relative torque errors in cross-validation. In bold: the selected terms; {rule}.",
                strong=(taken,),
                folded=len(rows) > LONG,
            )
        )
        if remark := results.get("selection_remark"):
            blocks.append(Text((f"{remark[0].upper()}{remark[1:]}.",)))
    else:
        blocks.append(Text(("The terms are declared in robot.yaml; none was selected from the recordings.",)))
    return Section("friction", "Friction", "", tuple(blocks))


def _words(labels: list[str]) -> str:
    return " + ".join(label.replace("_", " ") for label in labels)
