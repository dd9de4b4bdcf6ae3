"""Check of the prior that a calibration has from other robots of the model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check
from flexcal.report.results import chance_in_words

_QUESTION = "Is the robot like those that its prior is from?"


def check_fleet(block: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """The check from the block `fleet` of results.json; none for a calibration without such a prior."""
    if block is None:
        return ()
    conflict, robots = block["conflict"], len(block["robots"])
    if conflict["contradicted"]:
        return (
            Check(
                _QUESTION,
                f"No: the prior does not fit this robot, which deviates from the {robots} others {conflict['size']:.2g} times as much as "
                "they differ among each other. Calibrate it without --prior.",
                "bad",
                "fleet",
            ),
        )
    beside = f"beside {' or '.join(block['released'])} " if block["released"] else ""
    return (
        Check(
            _QUESTION,
            f"Yes: {beside}nothing in these measurements contradicts the {robots} others ({chance_in_words(conflict['probability'])}); "
            f"{len(block['from_fleet'])} of {block['parameters']} parameters are known from them, not from these measurements.",
            "good",
            "fleet",
        ),
    )


def check_pooled_stiffness(block: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """The check from the block `pooled_stiffness` of results.json; none where the stiffness is not from other robots, or fits."""
    if block is None or block["conflict"] is None or not block["conflict"]["contradicted"]:
        return ()
    return (
        Check(
            "Has the robot springs like those that its stiffness is from?",
            f"No ({chance_in_words(block['conflict']['probability'])}): the stiffness of the {len(block['robots'])} others does not fit "
            "this robot. Identify its stiffness, or calibrate it without --prior.",
            "bad",
            "fleet",
        ),
    )
