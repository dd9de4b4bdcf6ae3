"""Practical identifiability: parameters that noise and the choice of poses leave undetermined despite full rank."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import Whitening
from flexcal.calibration.fit.thermal_terms import is_thermal
from flexcal.calibration.measurement import PredictedMeasurements
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameters, analyse
from flexcal.model.kinematics import joint_positions, point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_SMALL_TURN = np.deg2rad(10)
"""Rotation of the tool over all poses below which the instrument's place absorbs the point's offset."""
_SMALL_RANGE = np.deg2rad(20)
"""Range of a joint below which its errors resemble those of its neighbours."""
_ON_AXIS = 1e-3
"""Distance of the measured point from a joint's axis, relative to the reach, below which that joint's direction is nearly hidden."""
_FLAT = 0.05
"""Ratio of the extent of the points normal to a plane to that in it, below which they count as flat."""


@dataclass(frozen=True)
class Undetermined:
    """Parameter whose standard deviation from the data exceeds its plausible `size`: held, with the `cause`."""

    name: str
    size: float
    cause: str


def undetermined(
    at: PredictedMeasurements,
    kept: Parameters,
    whitening: Whitening,
    hidden: tuple[str, ...],
    plausible: Mapping[str, float],
) -> tuple[Undetermined, ...]:
    """Parameters whose standard deviation from the data alone exceeds their plausible size.

    Judged on the kinematic Jacobian `at` the nominal robot without deflection, weighed by the `whitening`: what is seen only because the
    errors themselves, once estimated, turn the tool or bend the arm is not determined. `kept` are those of full rank on these poses;
    those that are `hidden`, which random poses would determine and these do not, are undetermined too. `plausible` are the sizes of
    them all, by name.
    """
    sizes = np.array([plausible[name] for name in kept.names])
    columns = whitening(at.jacobian(kept.names))
    largest = np.linalg.norm(columns * sizes, axis=0).max()
    identifiability = analyse(columns, kept.names, scale=sizes, tolerance=1 / max(largest, 1.0))
    lost = [item.name for item in identifiability.dropped]
    lost += hidden
    partners = {item.name: item.absorbed_by for item in identifiability.dropped}
    return tuple(
        Undetermined(name, plausible[name], cause_of(at, name, partners.get(name, ()))) for name in lost
    )


def cause_of(
    at: PredictedMeasurements, name: str, partners: tuple[tuple[str, float], ...] | None = None
) -> str:
    """Clause for the user: the property of the poses that hides a parameter; empty for none but unknown `partners`."""
    start, poses = at.model, at.poses
    owner = name.rpartition(".")[0]
    if is_thermal(name) and poses.temperature is not None:
        return f"the temperature varied by {np.ptp(poses.temperature):.1f} K only, at the scatter of these measurements"
    if owner == "tool" or owner.startswith("point."):
        turned = _turning(start, poses, owner)
        if turned < _SMALL_TURN:
            return f"the tool turned by {np.rad2deg(turned):.1f}° only, so its offset is not identifiable beside the instrument"
    positions = joint_positions(start, poses.q)
    for i in _neighbours(start, owner):
        joint = start.joints[i]
        extent = float(np.ptp(positions[:, i]))
        if joint.kind == "revolute" and extent < _SMALL_RANGE:
            return f"{joint.name} moved {np.rad2deg(extent):.1f}° only"
    own = start.joint_index(owner) if owner in start.joint_names else start.n - 1
    for joint in start.joints[own : own + 2]:
        # its errors, and those of the joint before it, are hidden if the point is on its axis
        lever = float(np.linalg.norm(at.jacobian([f"{joint.name}.offset"])[: len(poses)], axis=1).max())
        if joint.kind == "revolute" and lever < _ON_AXIS * start.reach:
            return (
                f"the point {poses.target[0]} lies {lever / MILLIMETRE:.1f} mm from the axis of {joint.name}, whose errors are then hardly "
                "told from its neighbours'"
            )
    shape = _shape(poses.position) if poses.located.all() else ""
    if shape:
        return shape
    if partners is None:
        return ""
    with_ = " and ".join(partner for partner, _ in partners[:2])
    return (
        f"it is not identifiable beside {with_} at the scatter of these measurements"
        if with_
        else "these measurements do not depend on it"
    )


def _turning(start: RobotModel, poses: PoseSet, owner: str) -> float:
    """Largest angle (rad) between the orientations of the tool and the first one."""
    point = owner.removeprefix("point.") if owner.startswith("point.") else None
    turn = point_kinematics(start, poses.q, point=point, jacobians=False).orientation
    trace = np.einsum("nij,ij->n", turn, turn[0])
    return float(np.arccos(np.clip((trace - 1) / 2, -1, 1)).max())


def _neighbours(start: RobotModel, owner: str) -> list[int]:
    """Indices of the owning joint and those before and after it; for the tool the last one."""
    if owner not in start.joint_names:
        return [] if owner.startswith("loop.") else [len(start.joints) - 1]
    i = start.joint_index(owner)
    return [k for k in (i, i - 1, i + 1) if 0 <= k < len(start.joints)]


def _shape(position: np.ndarray) -> str:
    centred = position - position.mean(axis=0)
    extents = np.linalg.svd(centred, compute_uv=False) / np.sqrt(len(position))
    if extents[1] < _FLAT * extents[0]:
        return f"all points lie within {2 * extents[1] / MILLIMETRE:.0f} mm of a line"
    if extents[2] < _FLAT * extents[1]:
        return f"all points lie within {2 * extents[2] / MILLIMETRE:.0f} mm of a plane"
    return ""
