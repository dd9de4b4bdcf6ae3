"""Results of measurements with inclinometers: residuals of their axes, and what they tell of the base."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.kinds import declared_level, inclinometer
from flexcal.calibration.verification import MILLIRADIAN, MeasuredTilts, TiltStatistics
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import STATION, VERTICAL

_TURNED = np.deg2rad(15)
"""Rotation of the found mounting from the declared one above which axes or signs are confused."""


def inclination_document(fit: GeometricFit, tilts: MeasuredTilts) -> dict[str, Any]:
    """Block `inclination` of results.json: errors by inclinometer, mrad, without outliers, the same before, and the mounting found."""
    outliers, document = set(fit.estimate.outliers), {}
    kept = np.array([row not in outliers for row in np.flatnonzero(fit.poses.tilted).tolist()])
    for name in tilts.sensors:
        own = (tilts.sensor == name) & kept
        document[name] = {
            **TiltStatistics.of(tilts.calibrated[own]).document(),
            "before": TiltStatistics.of(tilts.before[own]).document(),
            "mounting_rad": [fit.model.value(f"point.{name}.{key}") for key in STATION[3:]],
        }
    return document


def inclination_remarks(fit: GeometricFit) -> tuple[str, ...]:
    """Remarks on inclinometers: confused axes, what they leave open, and the inclination of the base."""
    names = dict.fromkeys(fit.poses.target[fit.poses.tilted].tolist())
    if not names:
        return ()
    remarks = [sentence for name in names if (sentence := _confused(fit, name))]
    base = _base_inclination(fit)
    if base is not None:
        remarks.append(base)
    if not len(fit.poses.pointed):
        remarks.append(
            "inclinometers tell how links are turned and nothing of lengths, places or rotations about the vertical: all lengths and the "
            "tool stay at their nominal values with unknown errors, so nothing is said of positions; measure points too where these matter"
        )
    return tuple(remarks)


def _confused(fit: GeometricFit, name: str) -> str:
    """Sentence on a mounting far from the declared one; empty where none is declared, or it agrees."""
    if inclinometer(fit.model, name).rpy is None:
        return ""
    turn = fit.model.geometry.point_turn[list(fit.model.points).index(name)]
    if np.linalg.norm(turn) < _TURNED:
        return ""
    axes = vector_rotation(turn)
    parts = []
    for k, axis in enumerate("xyz"):
        nearest = int(np.argmax(np.abs(axes[:, k])))
        sign = "-" if axes[nearest, k] < 0 else "+"
        if nearest != k or sign == "-":
            parts.append(f"its {axis} axis lies along the declared {sign}{'xyz'[nearest]}")
    which = f": {', '.join(parts)}" if parts else ""
    return (
        f"the inclinometer {name} is mounted {np.rad2deg(np.linalg.norm(turn)):.0f}° away from the declared `rpy`{which}. Axes of the file "
        "may be exchanged or of the wrong sign; the fit is the same, for the mounting found takes them up"
    )


def _base_inclination(fit: GeometricFit) -> str | None:
    """Sentence on the inclination of the base against the vertical; None where no instrument of points fixes the base frame."""
    if declared_level(fit.model, fit.poses):
        return "the base is taken as level, as declared: its inclination would show as misalignments of the first joint"
    if not fit.poses.located.any():
        return None
    names = [name for name in fit.estimate.parameters.names if name.startswith(f"station.{VERTICAL}.r")]
    up = vector_rotation(fit.model.stations.pose[fit.model.station_index(VERTICAL), 3:])[2]
    gravity = -fit.model.gravity / np.linalg.norm(fit.model.gravity)
    angle = float(np.arccos(np.clip(up @ gravity, -1, 1)))
    stds = [std for name in names if (std := fit.estimate.std(name)) is not None]
    spread = f" ± {float(np.max(stds)) / MILLIRADIAN:.2g}" if stds else ""
    return (
        f"the vertical is inclined to `gravity` of robot.yaml by {angle / MILLIRADIAN:.3g}{spread} mrad, in the base frame that fits the "
        "nominal robot best; the first joint's axis has its own misalignments in that frame"
    )
