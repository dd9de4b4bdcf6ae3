"""Stage 2 in the report: the geometry from measured points."""

from __future__ import annotations

import numpy as np

from flexcal.calibration import Calibration
from flexcal.report.figures.arm_poses import arm_poses
from flexcal.report.figures.calibration_errors import calibration_errors
from flexcal.report.figures.error_components import error_components
from flexcal.report.notation import millimetres
from flexcal.report.page import FigureBlock, Section, Selector
from flexcal.report.sections.identifiability import identifiability_blocks
from flexcal.report.sections.parameters import parameter_table
from flexcal.report.study import TwoStageStudy

_ARROW_LENGTH = 0.25
"""Length (m) at which the largest error is drawn, about."""

_MOST_POSES = 60


def geometry_section(study: TwoStageStudy) -> Section:
    """Figs. 10-12, identifiability and the parameters."""
    fit = study.calibration
    before = study.nominal_at_calibration.errors
    return Section(
        "stage2",
        "Stage 2: geometry",
        f"A laser tracker measured the tool in {len(fit.poses)} poses. With the springs known, the arm's sag is computed for each pose and "
        "what remains is geometry: axes that are not quite parallel, links that are not quite as long as drawn, zero positions of the "
        "encoders, and play in the gears.",
        (
            pose_figure(fit, before, "Figure 10"),
            error_figure(fit, before, "Figure 11"),
            component_figure(fit),
            *identifiability_blocks(fit.identifiability, study.paper),
            parameter_table(fit.estimate, fit.identifiability.kept_names, study.truth),
        ),
    )


def pose_figure(fit: Calibration, before: np.ndarray, number: str = "") -> FigureBlock:
    """Fig. 10; of many poses only some, evenly chosen, are drawn."""
    total = len(fit.poses)
    rows = np.unique(np.linspace(0, total - 1, min(total, _MOST_POSES)).astype(int))
    arrows = {}
    for words, errors, calibrated in (
        ("after calibration", fit.residuals, True),
        ("as delivered", before, False),
    ):
        factor = exaggeration(errors)
        arrows[f"{words}, × {factor:g}"] = (in_base(fit, errors)[rows], factor, calibrated)
    return FigureBlock(
        "figure-10",
        title(number, f"the {total} calibration poses"),
        arm_poses(fit.model, fit.poses.subset(rows), arrows),
        ("" if len(rows) == total else f"{len(rows)} of the {total} poses, evenly chosen. ")
        + "The arm as lines from joint to joint; drag to turn it. Arrows show which way and how far the measured point is from the "
        "predicted one, exaggerated as the choice above says.",
        f"Three-dimensional line drawing of the arm in {len(rows)} poses with exaggerated error arrows.",
        (Selector("Error arrows", "arrows", tuple(arrows)),),
    )


def error_figure(fit: Calibration, before: np.ndarray, number: str = "") -> FigureBlock:
    """Fig. 11."""
    return FigureBlock(
        "figure-11",
        title(number, "error at the calibration poses, before and after"),
        calibration_errors(fit.poses, before, fit.residuals),
        "Distance between measured and predicted point. The scale is logarithmic: one step of the grid is about a factor of two. These "
        "poses were used for the fit, so this is not yet the accuracy to expect elsewhere.",
        f"Error of each of {len(fit.poses)} poses as delivered, up to {millimetres(float(np.linalg.norm(before, axis=1).max()))} mm, and "
        f"calibrated, up to {millimetres(fit.errors.max)} mm.",
    )


def component_figure(fit: Calibration) -> FigureBlock:
    """Fig. 12."""
    largest = np.abs(fit.residuals).max(axis=0)
    return FigureBlock(
        "figure-12",
        "Figure 12: what is left at the calibration poses, by coordinate",
        error_components(fit.poses, fit.residuals),
        "Measured minus predicted position in the instrument's frame. Bars that stay within the dotted lines and change sign at random are "
        "measurement noise; a pattern would be something that the model misses.",
        "Residuals by pose; the largest are "
        + ", ".join(f"{millimetres(float(v))} mm in {axis}" for v, axis in zip(largest, "xyz", strict=True))
        + ".",
    )


def title(number: str, words: str) -> str:
    """ "Figure 10: the poses", or "The poses" without a number."""
    return f"{number}: {words}" if number else words[0].upper() + words[1:]


def in_base(fit: Calibration, errors: np.ndarray) -> np.ndarray:
    """Error vectors (N, 3) of the instrument's frame turned into the robot's base frame."""
    from flexcal.model.names import STATION
    from flexcal.model.rotations import vector_rotation

    turned = np.empty_like(errors)
    for station in fit.poses.stations:
        angles = np.array([fit.model.value(f"station.{station}.{key}") for key in STATION[3:]])
        own = fit.poses.station == station
        turned[own] = errors[own] @ vector_rotation(angles)
    return turned


def exaggeration(errors: np.ndarray) -> float:
    """A round factor 1, 2 or 5 × 10^k by which the largest error becomes about a quarter of a metre long."""
    wanted = _ARROW_LENGTH / max(float(np.linalg.norm(errors, axis=1).max(initial=0.0)), 1e-9)
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(max(m * decade for m in (1, 2, 5) if m * decade <= wanted * 1.001))
