"""Measured frequency responses with their noise and distortion levels."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.report.figures import response_levels
from flexcal.report.layout import FigureBlock, Selector
from flexcal.report.results import MeasuredResponse, uncertainty_sentence


def levels_block(
    id: str, title: str, responses: Sequence[MeasuredResponse], labels: Sequence[str]
) -> FigureBlock:
    """Fig. 5 of each response, one shown at a time."""
    return FigureBlock(
        id,
        title,
        response_levels(responses, labels),
        f"Acceleration of each motor (row) for a torque on each motor (column), at {len(responses[0].frequencies_hz)} "
        "frequencies. Valleys and peaks are antiresonances and resonances of the elastic arm. The lower curves are one standard "
        "deviation of the mean: "
        "noise of the sensors, and distortion by friction and backlash, which repeats with the excitation and is not noise.",
        uncertainty_sentence(responses),
        (Selector("Pose", "pose", tuple(labels)),) if len(labels) > 1 else (),
    )
