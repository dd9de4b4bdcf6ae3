"""Residuals of inclinometers, before and after."""

from __future__ import annotations

from collections.abc import Mapping

from flexcal.calibration.verification import MILLIRADIAN, MeasuredTilts, TiltStatistics
from flexcal.report.figures import tilt_joints, tilt_order
from flexcal.report.layout import FigureBlock, Section, Table, significant

_NOTE = (
    "Differences between the readings and those of the robot. Before, the nominal robot, with the mounting and the zeros of the sensor and "
    "the inclination of the base fitted to the readings."
)


def tilts_section(joints: Mapping[str, str], tilts: MeasuredTilts) -> Section:
    """Table and figures of the residuals of inclinometers; `joints` are kinds by name."""
    return Section(
        "tilts",
        "Inclinometers",
        "If the model is complete, the residuals scatter about zero, whatever the pose.",
        (
            tilt_table(tilts),
            FigureBlock(
                "figure-tilts",
                "Residuals of the inclinometers in the order of measuring",
                tilt_order(tilts),
                "A drift indicates a sensor that warms up, a step one that was hit or moved.",
                f"Residuals of {len(tilts.sensors)} inclinometers at {len(tilts.pose)} poses by axis, before and as calibrated.",
            ),
            FigureBlock(
                "figure-tilt-joints",
                "Residuals of the inclinometers against every joint",
                tilt_joints(joints, tilts),
                "A pattern over a joint indicates transmission errors, deflection under gravity, or a sensor whose scale is wrong.",
                f"Residuals in mrad against the position of each of {len(joints)} joints.",
            ),
        ),
    )


def tilt_table(tilts: MeasuredTilts) -> Table:
    """Errors of every inclinometer before and after."""
    rows = []
    for sensor in tilts.sensors:
        own = tilts.sensor == sensor
        for label, errors in (("before", tilts.before), ("calibrated", tilts.calibrated)):
            read = TiltStatistics.of(errors[own])
            sizes = (significant(size / MILLIRADIAN, 3) for size in (read.rms, read.mean, read.p90, read.max))
            rows.append((f"{sensor}, {label}", str(read.poses), *sizes))
    columns = ("inclinometer", "poses", "rms / mrad", "mean / mrad", "P90 / mrad", "max / mrad")
    return Table("table-tilts", "Errors of the inclinometers", columns, tuple(rows), note=_NOTE)
