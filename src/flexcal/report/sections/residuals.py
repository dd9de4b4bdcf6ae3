"""Residuals against joint positions, order, time, temperature and position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.calibration.diagnostics import GravityLoads
from flexcal.calibration.verification import CALIBRATED, ArmPoses
from flexcal.data.poses import PoseSet
from flexcal.report.figures import (
    error_field,
    loaded_joints,
    residual_joints,
    residual_torque,
    residual_trend,
    residual_workspace,
)
from flexcal.report.layout import Block, FigureBlock, Section, Table, millimetres
from flexcal.report.sections.measured_words import MeasuredWords

_MOST = 12


def residuals_section(
    joints: Mapping[str, str],
    poses: PoseSet,
    residuals: np.ndarray,
    outliers: Sequence[int],
    loads: GravityLoads | None = None,
    arms: ArmPoses | None = None,
) -> Section:
    """Residuals (N, 3) m of a fit, and the rows of its `outliers`; `joints` are kinds by name, `arms` where points have no common frame."""
    blocks = residual_blocks(joints, poses, residuals, arms)
    if loads is not None and loaded_joints(joints, loads):
        blocks = (*blocks, _torque_figure(joints, loads))
    if outliers:
        blocks = (*blocks, _outlier_table(poses, residuals, outliers))
    return Section(
        "residuals",
        "Residuals",
        "If the model is complete, residuals depend neither on time nor on the pose.",
        blocks,
    )


def _torque_figure(joints: Mapping[str, str], loads: GravityLoads) -> FigureBlock:
    return FigureBlock(
        "figure-torque",
        "Residuals against the gravity torque of every joint",
        residual_torque(joints, loads),
        "The part of the residual along the motion of the point by a joint, against the gravity torque that its drive holds. A line that "
        "slopes is a compliance that the model lacks; joints that gravity does not load are left out.",
        f"Residuals against gravity torque in one panel for each of {len(loaded_joints(joints, loads))} joints, with fitted lines.",
    )


def residual_blocks(
    joints: Mapping[str, str], poses: PoseSet, residuals: np.ndarray, arms: ArmPoses | None = None
) -> tuple[Block, ...]:
    """Residuals (N, 3) m in the order of measuring, against time and temperature where they are known, by joint and in space.

    In space they are those of the `arms` at measurements without a common frame, as of a fixture that was moved.
    """
    words = MeasuredWords.of(poses)
    pose, position, in_space = poses.pose, poses.position, residuals
    if arms is not None:
        pose, position, in_space = arms.pose, arms.tip, arms.errors[CALIBRATED]
    distance = np.linalg.norm(in_space, axis=1)
    worst = int(distance.argmax())
    blocks: list[Block] = [
        FigureBlock(
            "figure-order",
            "Residuals in the order of measuring",
            residual_trend(np.arange(1.0, len(poses) + 1), residuals, "measurement, in order"),
            f"A drift of the running mean indicates {words.drift}. With a complete model residuals scatter about zero.",
            f"Residuals of {len(poses)} {words.rows} by coordinate in measuring order, with a running mean.",
        )
    ]
    for quantity, label, meaning in _CONDITIONS:
        values = getattr(poses, quantity)
        if values is not None and np.ptp(values) > 0:
            blocks.append(
                FigureBlock(
                    f"figure-{quantity}",
                    f"Residuals against {quantity}",
                    residual_trend(values, residuals, label),
                    meaning,
                    f"Residuals of {len(poses)} {words.rows} by coordinate against {quantity}, with a running mean.",
                )
            )
    blocks += [
        FigureBlock(
            "figure-joints",
            "Residuals against every joint",
            residual_joints(joints, poses, residuals),
            "A periodic pattern over a joint indicates transmission errors; growth towards one end indicates deflection that the model "
            "lacks.",
            "Error against the position of each joint, with means in bins.",
        ),
        FigureBlock(
            "figure-field",
            "Components of the residual over the working volume",
            error_field(position, in_space),
            f"Each component of the error vector (rows) against each coordinate of the point (columns), in {words.frame}. Where the means "
            "leave zero, the error is systematic.",
            f"Nine panels of residual components against coordinates of {len(pose)} {words.rows}, with means in bins.",
        ),
        FigureBlock(
            "figure-workspace",
            "Residuals in the working volume",
            residual_workspace(pose, position, in_space),
            f"The tool's point at every measurement in {words.frame}, coloured by its error; drag to turn. Regions of one colour indicate "
            "errors that depend on the place in the workspace.",
            f"Points in space coloured by error; the largest, {millimetres(float(distance[worst]))} mm, is at pose "
            f"{int(pose[worst])}.",
        ),
    ]
    return tuple(blocks)


_CONDITIONS = (
    (
        "time",
        "time / s",
        "A slope or a curve that flattens indicates an arm that warms up or an instrument that settles; breaks show as gaps.",
    ),
    (
        "temperature",
        "temperature / °C",
        "A slope is a drift of arm or instrument with temperature that the model lacks: calibrate with poses at several temperatures, or "
        "at the working temperature.",
    ),
)


def _outlier_table(poses: PoseSet, residuals: np.ndarray, outliers: Sequence[int]) -> Table:
    distance = np.linalg.norm(residuals, axis=1)
    rows = sorted(outliers, key=lambda row: -distance[row])
    held = poses.socket if poses.in_socket.any() else None
    cells = tuple(
        (
            str(int(poses.pose[i])),
            str(poses.target[i])
            if held is None or not held[i]
            else f"{poses.target[i]}, {poses.station[i]} {held[i]}",
            millimetres(float(distance[i])),
        )
        for i in rows[:_MOST]
    )
    more = len(rows) - len(cells)
    return Table(
        "table-outliers",
        f"{len(rows)} outliers, to which the robust loss gave hardly any weight",
        ("pose", "point" if held is None else "point, place and socket", "distance / mm"),
        cells,
        f"And {more} more, listed in results.json." if more > 0 else "",
        text_columns=(1,),
    )
