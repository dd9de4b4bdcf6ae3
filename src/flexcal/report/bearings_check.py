"""Whether the bearings tilt where robot.yaml says, judged by two fits to the same points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration import ErrorStatistics
from flexcal.report.notation import millimetres
from flexcal.report.page import Check

_WHERE = {
    "before": "bearing axes fixed to the parent link (`bearings: before`)",
    "after": "bearing axes that turn with the child link (`bearings: after`)",
}


def check_bearings(block: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """The check from the block `bearings` of results.json; none where there are no bearings, or the points do not tell."""
    if block is None or block["preferred"] is None:
        return ()
    question = "Do the bearings tilt about the axes that robot.yaml declares?"
    declared = block["declared"]
    other = "after" if declared == "before" else "before"
    mean, other_mean = (
        f"{millimetres(ErrorStatistics.of_millimetres(block[key]).mean)} mm"
        for key in ("errors", "other_errors")
    )
    if block["preferred"] == declared:
        return (
            Check(
                question,
                f"Yes: with {_WHERE[other]} the mean error is {other_mean} in place of {mean}.",
                "good",
                "bearings",
            ),
        )
    answer = f"No: with {_WHERE[other]} the mean error is {other_mean} in place of {mean}. Declare them, and calibrate again."
    return (Check(question, answer, "bad", "bearings"),)
