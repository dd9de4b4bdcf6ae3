"""Check of the declared bearing axes by two fits to the same data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.report.layout import Check, millimetres

_WHERE = {
    "before": "bearing axes fixed to the parent link (`bearings: before`)",
    "after": "bearing axes that turn with the child link (`bearings: after`)",
}

_QUESTION = "Do the bearings tilt about the right axes?"


def check_bearings(block: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """The check from the block `bearings` of results.json; none where there are no bearings, or the points do not tell."""
    if block is None or block["preferred"] is None:
        return ()
    better = block["preferred"]
    worse = "after" if better == "before" else "before"
    means = [
        millimetres(ErrorStatistics.of_millimetres(block["errors"][key]).mean) for key in (better, worse)
    ]
    figures = f"with {_WHERE[better]} the mean error of a first fit is {means[0]} mm, with {_WHERE[worse]} {means[1]} mm"
    if block["declared"] in (None, better):
        return (Check(_QUESTION, f"Yes: {figures}.", "good", "bearings"),)
    return (Check(_QUESTION, f"No: {figures}. Declare the former, and calibrate again.", "bad", "bearings"),)


def check_response_bearings(block: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """The check from the block `bearings` of stage 1; none where there are no bearings, or the responses do not tell."""
    if block is None or block["preferred"] is None:
        return ()
    better = block["preferred"]
    worse = "after" if better == "before" else "before"
    chi2 = [f"{block['reduced_chi2'][key]:.2f}" for key in (better, worse)]
    figures = f"with {_WHERE[better]} the reduced chi-square is {chi2[0]}, with {_WHERE[worse]} {chi2[1]}"
    if block["declared"] in (None, better):
        return (Check(_QUESTION, f"Yes: {figures}.", "good", "bearings"),)
    return (Check(_QUESTION, f"No: {figures}. Declare the former, and identify again.", "bad", "bearings"),)
