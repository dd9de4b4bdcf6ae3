"""What the fit leaves, against everything that might explain it."""

from __future__ import annotations

import numpy as np

from flexcal.calibration import Calibration
from flexcal.report.figures.residual_joints import residual_joints
from flexcal.report.figures.residual_order import residual_order
from flexcal.report.figures.residual_workspace import residual_workspace
from flexcal.report.notation import millimetres
from flexcal.report.page import Block, FigureBlock, Section, Table

_MOST = 12


def residuals_section(fit: Calibration) -> Section:
    """Residuals in order, by joint and in space, and the outliers."""
    distance = np.linalg.norm(fit.residuals, axis=1)
    worst = int(distance.argmax())
    blocks: list[Block] = [
        FigureBlock(
            "figure-order",
            "Residuals in the order of measuring",
            residual_order(fit.residuals),
            "A drift of the running mean points to warm-up or a moving instrument, a step to a bump. Scatter about zero is what remains "
            "when the model is right.",
            f"Residuals of {len(fit.poses)} points by coordinate in measuring order, with a running mean.",
        ),
        FigureBlock(
            "figure-joints",
            "Residuals against every joint",
            residual_joints(fit.model, fit.poses, fit.residuals),
            "A wave over one joint is an error of its transmission; growth towards one end is sag that the model misses.",
            "Error against the position of each joint, with means in bins.",
        ),
        FigureBlock(
            "figure-workspace",
            "Residuals in the working volume",
            residual_workspace(fit.poses, fit.residuals),
            "Each measured point in the instrument's frame, coloured by its error; drag to turn. Neighbours of one colour mean that the "
            "model misses something that depends on where the robot is.",
            f"Points in space coloured by error; the largest, {millimetres(float(distance[worst]))} mm, is at pose "
            f"{int(fit.poses.pose[worst])}.",
        ),
    ]
    if fit.estimate.outliers:
        blocks.append(_outlier_table(fit))
    return Section(
        "residuals",
        "What the fit leaves",
        "If the model is complete, nothing of what is left depends on when or where it was measured.",
        tuple(blocks),
    )


def _outlier_table(fit: Calibration) -> Table:
    distance = np.linalg.norm(fit.residuals, axis=1)
    rows = sorted(fit.estimate.outliers, key=lambda row: -distance[row])
    cells = tuple(
        (str(int(fit.poses.pose[i])), str(fit.poses.target[i]), millimetres(float(distance[i])))
        for i in rows[:_MOST]
    )
    more = len(rows) - len(cells)
    return Table(
        "table-outliers",
        f"{len(rows)} outliers that the robust loss set aside",
        ("pose", "point", "distance / mm"),
        cells,
        f"And {more} more, listed in results.json." if more > 0 else "",
        text_columns=(1,),
    )
