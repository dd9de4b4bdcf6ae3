"""Stage 2 in the report: the geometry from measured points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.verification import CALIBRATED, NOMINAL, ArmPoses
from flexcal.data.poses import PoseSet
from flexcal.report.figures import arm_poses, calibration_errors, error_components, error_histogram
from flexcal.report.layout import FigureBlock, Section, Selector, Slider, millimetres
from flexcal.report.sections.identifiability import identifiability_blocks
from flexcal.report.sections.measured_words import MeasuredWords
from flexcal.report.sections.parameters import parameter_table
from flexcal.report.sections.uncertainty_budget import budget_table

if TYPE_CHECKING:
    from flexcal.report.results import TwoStageStudy

_ARROW_LENGTH = 0.25
"""Length (m) at which the largest error is drawn, about, where points are few."""

_OVER_SPACING = 2.5
"""The same over the distance between neighbouring points, where they are many."""

ARROW_FACTORS = tuple(float(m * 10**k) for k in range(5) for m in (1, 2, 5))
"""Factors by which arrows can be exaggerated."""
_ARROWS = {CALIBRATED: "after calibration", NOMINAL: "before, the robot's own"}


def geometry_section(study: TwoStageStudy) -> Section:
    """Figs. 10-12, identifiability and the parameters."""
    points = study.points
    poses, before, after = points.poses, points.delivered, points.calibrated
    return Section(
        "stage2",
        "Stage 2: geometry",
        f"A laser tracker measured the tool in {len(poses)} poses. With the springs known, the arm's deflection under gravity is "
        f"computed for each pose; the remaining errors are geometric: axes that are not parallel, link lengths, joint offsets and "
        f"backlash.",
        (
            arm_figure(study.arms, poses),
            *([] if before is None else [error_figure(poses, before, after)]),
            component_figure(poses, after),
            budget_table(study.results["variances"]),
            *identifiability_blocks(study.determined, study.paper),
            parameter_table(study.geometry, study.kept, study.truth),
        ),
    )


def arm_figure(arms: ArmPoses, poses: PoseSet) -> FigureBlock:
    """Fig. 10; `arms` shows some or all of the measured `poses`."""
    total, words = len(poses), MeasuredWords.of(poses)
    labels = {model: words for model, words in _ARROWS.items() if model in arms.errors}
    length = min(_ARROW_LENGTH, _OVER_SPACING * _spacing(arms.tip))
    factors = {model: exaggeration(arms.errors[model], length) for model in labels}
    some = "" if len(arms.pose) == total else f"{len(arms.pose)} of the {total} {words.rows}, evenly chosen. "
    drawn = f"in {len(arms.corners)} poses" if len(arms.corners) < len(arms.pose) else "in every pose"
    largest = ", ".join(
        f"{millimetres(float(np.linalg.norm(arms.errors[model], axis=1).max()))} mm {words}"
        for model, words in labels.items()
    )
    return FigureBlock(
        "figure-10",
        f"Arm and error vectors of the {total} measured {words.rows}",
        arm_poses(arms, labels, factors),
        f"{some}The links in {len(arms.surface)} poses, and lines from joint to joint {drawn}. Drag to rotate, Ctrl and the wheel to "
        f"zoom. Arrows point {words.arrow}, exaggerated as chosen above; the longest is {largest}.",
        f"Three-dimensional drawing of the arm {drawn} with exaggerated error arrows; the longest is {largest}.",
        (Selector("Error arrows", "arrows", tuple(labels.values())),),
        Slider("Exaggeration", "arrows", ARROW_FACTORS, {labels[model]: factors[model] for model in labels}),
    )


def error_figure(poses: PoseSet, before: np.ndarray, after: np.ndarray) -> FigureBlock:
    """Fig. 11."""
    was, now = (millimetres(float(np.linalg.norm(e, axis=1).max())) for e in (before, after))
    return FigureBlock(
        "figure-11",
        "Error at the calibration poses, before and after",
        calibration_errors(poses, before, after),
        f"{MeasuredWords.of(poses).distance}. The scale is logarithmic: one step of the grid is about a factor of two. These "
        "poses were used for the fit, so this is not yet the accuracy to expect elsewhere.",
        f"Error of each of {len(poses)} poses before (the robot's own), up to {was} mm, and calibrated, up to {now} mm.",
    )


def error_figures(poses: PoseSet, before: np.ndarray, after: np.ndarray) -> tuple[FigureBlock, FigureBlock]:
    """Errors before and after by pose, and their histogram."""
    was, now = (millimetres(float(np.median(np.linalg.norm(e, axis=1)))) for e in (before, after))
    return (
        error_figure(poses, before, after),
        FigureBlock(
            "figure-histogram",
            "Histogram of the errors, before and after",
            error_histogram({NOMINAL: before, CALIBRATED: after}),
            f"Share of the {MeasuredWords.of(poses).rows} in each range of distance; ranges are equally wide on the logarithmic scale. "
            "Dotted lines: medians.",
            f"Two histograms of distances; the median is {was} mm before and {now} mm after.",
        ),
    )


def component_figure(poses: PoseSet, residuals: np.ndarray) -> FigureBlock:
    """Fig. 12."""
    largest = np.abs(residuals).max(axis=0)
    return FigureBlock(
        "figure-12",
        "Residuals at the calibration poses, by coordinate",
        error_components(poses, residuals),
        "Measured minus predicted position in the instrument's frame. Bars that stay within the dotted lines and change sign at random are "
        "measurement noise; a pattern indicates a term that the model lacks.",
        "Residuals by pose; the largest are "
        + ", ".join(f"{millimetres(float(v))} mm in {axis}" for v, axis in zip(largest, "xyz", strict=True))
        + ".",
    )


def exaggeration(errors: np.ndarray, length: float) -> float:
    """The factor of the slider by which the largest of `errors` (N, 3) m becomes about `length` (m) long."""
    wanted = length / max(float(np.linalg.norm(errors, axis=1).max(initial=0.0)), 1e-9)
    return max((factor for factor in ARROW_FACTORS if factor <= wanted * 1.001), default=ARROW_FACTORS[0])


def _spacing(points: np.ndarray) -> float:
    """Distance between neighbours if `points` (N, 3) filled the box about them evenly."""
    return float(np.prod(np.maximum(np.ptp(points, axis=0), 0.05)) / len(points)) ** (1 / 3)
