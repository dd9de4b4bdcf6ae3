"""How many places and poses a calibration by a ball in sockets needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.report.figures import learning_curves
from flexcal.report.layout import FigureBlock, Section, document_millimetres


def learning_section(points: Sequence[Mapping[str, Any]]) -> Section:
    """Errors at left-out places by what the fit has; `points` is the block `learning_curve` of results.json."""
    few, most = points[0], points[-1]
    return Section(
        "learning",
        "How many places and poses are enough",
        "Every place of the fixture is left out of fits to 2, 3, … of the others, with a quarter, a half and all of their poses; up to "
        "four sets of others are tried. The terms are those of the calibration, and the fits are linear, about its solution.",
        (
            FigureBlock(
                "figure-learning",
                "Error at places left out of the fit, by places and poses in it",
                learning_curves(points),
                f"{few['places']} places with {few['poses_per_socket']:.0f} poses in a socket give "
                f"{document_millimetres(few['mean_mm'])} mm, {most['places']} with {most['poses_per_socket']:.0f} "
                f"{document_millimetres(most['mean_mm'])} mm. Where lines are level, further places and poses gain little: the scatter of "
                "robot and ball is what is left.",
                f"Mean errors at left-out places for {len(points)} numbers of places and poses.",
            ),
        ),
    )
