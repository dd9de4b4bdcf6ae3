"""Results of measurements with inclinometers: residuals of their axes, and what they tell of the base."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.kinds import declared_level, inclinometer
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import STATION, VERTICAL

_TURNED = np.deg2rad(15)
"""Rotation of the found mounting from the declared one above which axes or signs are confused."""
_MRAD = 1e-3


def inclination_document(fit: GeometricFit) -> dict[str, Any] | None:
    """Block `inclination` of results.json: residuals by inclinometer, mrad, and the mounting found; null without inclinometers."""
    poses = fit.poses
    if not poses.tilted.any():
        return None
    names, outliers = poses.target[poses.tilted], set(fit.estimate.outliers)
    kept = np.array([row not in outliers for row in np.flatnonzero(poses.tilted).tolist()])
    document = {}
    for name in dict.fromkeys(names.tolist()):
        left = np.abs(fit.tilts[(names == name) & kept])
        read = left[np.isfinite(left)]
        document[name] = {
            "poses": len(left),
            "rms_mrad": float(np.sqrt(np.mean(read**2))) / _MRAD,
            "max_mrad": float(read.max()) / _MRAD,
            "mounting_rad": [fit.model.value(f"point.{name}.{key}") for key in STATION[3:]],
        }
    return document


def inclination_remarks(fit: GeometricFit) -> tuple[str, ...]:
    """Remarks on inclinometers: scatter, confused axes, what they leave open, and the inclination of the base."""
    document = inclination_document(fit)
    if document is None:
        return ()
    remarks = [
        f"the inclinometer {name} is fitted to {entry['rms_mrad']:.3g} mrad rms (max {entry['max_mrad']:.3g}) at {entry['poses']} poses"
        for name, entry in document.items()
    ]
    remarks += [sentence for name in document if (sentence := _confused(fit, name))]
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
    spread = f" ± {float(np.max(stds)) / _MRAD:.2g}" if stds else ""
    return (
        f"the vertical is inclined to `gravity` of robot.yaml by {angle / _MRAD:.3g}{spread} mrad, in the base frame that fits the nominal "
        "robot best; the first joint's axis has its own misalignments in that frame"
    )
