"""Tool error due to terms that a file format cannot represent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from flexcal.model.kinematics import joint_limits, point_kinematics, random_configurations, reach_points
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium
from flexcal.units import MILLIMETRE

DEFLECTION = "elastic deflection"
BACKLASH = "backlash"
GRAVITY_COMPLIANCE = "gravity compliance"
LATERAL_COMPLIANCE = "lateral gravity compliance"
TRANSMISSION = "transmission error"
HARDENING = "hardening of drives"
GEOMETRY = "axis misalignments and lengths"
AT_REST = (DEFLECTION, BACKLASH, GRAVITY_COMPLIANCE, LATERAL_COMPLIANCE, TRANSMISSION)
"""Terms beyond rigid geometry, which hardly any format can represent."""

SAMPLES = 2000
_AGREED = 1e-9
"""Agreement, mm, below which nothing is reported."""
_SAME = 1e-4
"""Agreement, mm, above which a file that can carry everything differs at some poses: those on the other side of a gap."""
_TRIES = 4
_LEAST_REACHED = 50
_STROKE = 1.0
"""Assumed stroke, ± m, of a prismatic joint without limits."""
_TURNS = 4 * np.pi
"""Range, rad, above which a revolute joint counts as one without limits."""

ToolMap = Callable[[np.ndarray], np.ndarray]
"""Function from joint positions (N, n), rad or m, to positions (N, 3), m."""
DrawPoses = Callable[[str | None, np.random.Generator], tuple[np.ndarray, str]]
"""Random joint positions (N, n) for a point, by default the first, and the space within which they are."""


@dataclass(frozen=True)
class PositionErrors:
    """Mean, 95th percentile and maximum of the tool error, m."""

    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, errors: np.ndarray) -> PositionErrors:
        """Errors from differences of positions (N, 3), m."""
        distance = np.linalg.norm(errors, axis=1)
        return cls(float(distance.mean()), float(np.percentile(distance, 95)), float(distance.max()))

    def in_millimetres(self) -> dict[str, float]:
        """Errors as in documents."""
        return {
            "mean_mm": self.mean / MILLIMETRE,
            "p95_mm": self.p95 / MILLIMETRE,
            "max_mm": self.max / MILLIMETRE,
        }


@dataclass(frozen=True)
class ExportErrors:
    """The `terms` that a file lacks, and the `error` between the robot at rest and the file as written, over poses `within` a space.

    `error` is None for a robot without points, which has no tool to be off; `payload` is what the robot carries, kg. `nominal` is the error
    of the nominal robot over the same poses, its base and point fitted, where it is known. A file without `geometry` has no tool at all.
    """

    terms: tuple[str, ...]
    error: PositionErrors | None
    poses: int
    within: str
    payload: float
    nominal: PositionErrors | None = None
    geometry: bool = True

    @property
    def document(self) -> dict[str, Any]:
        """Entries of JSON documents."""
        error, nominal = self.error, self.nominal
        return {
            "lost": [{"term": term} for term in self.terms],
            "tool_error": error and error.in_millimetres() | {"poses": self.poses, "within": self.within},
            "nominal_error": nominal and nominal.in_millimetres(),
        }

    @property
    def sentences(self) -> tuple[str, ...]:
        """Errors in sentences."""
        if not self.geometry:
            return (
                "The file has actuators only: links and joints are those of the robot that is loaded beside it.",
            )
        beside = ""
        if self.nominal is not None and self.nominal.max / MILLIMETRE > _SAME:
            off = self.nominal.in_millimetres()
            beside = (
                f"; the nominal robot, its base and point fitted, is off by {off['mean_mm']:.3f} mm on average, "
                f"{off['max_mm']:.3f} mm at most"
            )
        if not self.terms:
            if self.error is None:
                return ("Nothing is lost.",)
            if self.error.max / MILLIMETRE > _SAME:
                return (
                    f"Nothing is lost, but where gravity hardly presses a drive to one side of its gap: there the tool is off by "
                    f"{self.error.max / MILLIMETRE:.3f} mm at most, and by {max(self.error.p95 / MILLIMETRE, _AGREED):.0e} mm in 95 % of "
                    f"{self.poses} random poses of the {self.within}{beside}.",
                )
            return (
                f"Nothing is lost: the file agrees with the calibrated robot to {max(self.error.max / MILLIMETRE, _AGREED):.0e} mm "
                f"over {self.poses} random poses of the {self.within}{beside}.",
            )
        named = ", ".join(self.terms)
        if self.error is None:
            return (
                f"This format cannot carry {named}. What that costs is not known: robot.yaml declares no point.",
            )
        off = self.error.in_millimetres()
        carrying = f", carrying {self.payload:.3g} kg" if self.payload > 0 else ""
        return (
            f"This format cannot carry {named}.",
            f"The tool is off by {off['mean_mm']:.3f} mm on average, {off['p95_mm']:.3f} mm in 95 % of poses and "
            f"{off['max_mm']:.3f} mm at most, over {self.poses} random poses of the {self.within}{carrying}{beside}.",
        )


def tool_positions(
    model: RobotModel, q: np.ndarray, *, point: str | None = None, flank: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Target positions (N, 3), m, of the robot at rest with all known terms, and the flanks (N, n) of its backlash."""
    rest = static_equilibrium(model, q, flank=flank)
    return point_kinematics(model, q, rest.deflection, point=point, jacobians=False).position, rest.flank


def drawing_limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper end (n,) between which poses are drawn, rad or m: of joints without limits one turn, or ± 1 m."""
    lower, upper = joint_limits(model)
    slides = np.array([joint.kind == "prismatic" for joint in model.motor_joints])
    free = ~(upper - lower <= np.where(slides, np.finfo(float).max, _TURNS))
    reach = np.where(slides, _STROKE, np.pi)
    return np.where(free, -reach, lower), np.where(free, reach, upper)


def random_poses(
    model: RobotModel, point: str | None, rng: np.random.Generator, ranges: np.ndarray | None = None
) -> tuple[np.ndarray, str]:
    """Random joint positions (N, n) with the target in the declared working volume, or over the whole joint range without one.

    The second value says which. Where fewer than 50 of the tries reach the volume, it is the joint range, too. `ranges` (2, n) take the
    place of the `drawing_limits`.
    """
    lower, upper = drawing_limits(model) if ranges is None else ranges
    box = model.config.working_volume
    if box is not None:
        targets = rng.uniform(box.lower, box.upper, (SAMPLES // _TRIES, 3))
        starts = rng.uniform(lower, upper, (_TRIES, len(targets), model.n))
        tried = [reach_points(model, targets, start, lower, upper, point=point) for start in starts]
        poses = np.concatenate([q[reached] for q, reached in tried])
        if len(poses) >= _LEAST_REACHED:
            return poses, "working volume"
    return random_configurations(model, SAMPLES, rng, lower, upper), "joint range"


def poses_of(model: RobotModel, draw: DrawPoses | None) -> DrawPoses:
    """`draw`, by default `random_poses` of `model`."""
    return partial(random_poses, model) if draw is None else draw


def leave_out(model: RobotModel, term: str) -> RobotModel:
    """Robot without a term; unchanged if it does not have it."""
    geometry, springs, drives = model.geometry, model.springs, model.drives
    if term == GEOMETRY:
        parts = (
            geometry.errors[:, 1:],
            geometry.origin_error,
            geometry.tool,
            geometry.point_error,
            geometry.loops,
        )
        if not any(part.any() for part in parts):
            return model
        geometry = replace(
            geometry,
            errors=geometry.errors * (np.arange(6) == 0),
            origin_error=np.zeros_like(geometry.origin_error),
            tool=np.zeros(6),
            point_error=np.zeros_like(geometry.point_error),
            loops=np.zeros_like(geometry.loops),
        )
    elif term == DEFLECTION and model.elastic:
        return model.without_springs()
    elif term == BACKLASH and drives.backlash.any():
        drives = replace(drives, backlash=np.zeros_like(drives.backlash))
    elif term == GRAVITY_COMPLIANCE and geometry.gravity_compliance.any():
        geometry = replace(geometry, gravity_compliance=np.zeros_like(geometry.gravity_compliance))
    elif term == LATERAL_COMPLIANCE and geometry.lateral_compliance.any():
        geometry = replace(geometry, lateral_compliance=np.zeros_like(geometry.lateral_compliance))
    elif term == HARDENING and springs.hardening.any():
        springs = replace(springs, hardening=np.zeros_like(springs.hardening))
    elif term == TRANSMISSION and (drives.transmission.any() or drives.ratio_error.any()):
        waves, ratios = np.zeros_like(drives.transmission), np.zeros_like(drives.ratio_error)
        drives = replace(drives, transmission=waves, ratio_error=ratios)
    else:
        return model
    return replace(model, geometry=geometry, springs=springs, drives=drives)
