"""Tool error due to terms that a file format cannot represent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
_CALIBRATED = (GRAVITY_COMPLIANCE, LATERAL_COMPLIANCE, TRANSMISSION)
"""Terms that a calibration fits beside the geometry, which compensates for them if fitted alone."""

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
class UnrepresentedTerm:
    """A term that a format cannot represent, and the tool error where it alone is left out (None: there is no tool)."""

    name: str
    error: PositionErrors | None


@dataclass(frozen=True)
class ExportErrors:
    """Export errors: term by term, and the whole `error` between the robot at rest and the file as written, over poses `within` a space.

    `error` is None for a robot without points, which has no tool to be off; `payload` is what the robot carries, kg. A file without
    `geometry` has no tool at all.
    """

    terms: tuple[UnrepresentedTerm, ...]
    error: PositionErrors | None
    poses: int
    within: str
    payload: float
    geometry: bool = True

    @property
    def sentences(self) -> tuple[str, ...]:
        """Errors in sentences."""
        if not self.geometry:
            return (
                "The file has actuators only: links and joints are those of the robot that is loaded beside it.",
            )
        if not self.terms:
            if self.error is None:
                return ("Nothing is lost.",)
            if self.error.max / MILLIMETRE > _SAME:
                return (
                    f"Nothing is lost, but where gravity hardly presses a drive to one side of its gap: there the tool is off by "
                    f"{self.error.max / MILLIMETRE:.3f} mm at most, and by {max(self.error.p95 / MILLIMETRE, _AGREED):.0e} mm in 95 % of "
                    f"{self.poses} random poses of the {self.within}.",
                )
            return (
                f"Nothing is lost: the file agrees with the calibrated robot to {max(self.error.max / MILLIMETRE, _AGREED):.0e} mm "
                f"over {self.poses} random poses of the {self.within}.",
            )
        named = ", ".join(f"{term.name}{_alone(term.error)}" for term in self.terms)
        if self.error is None:
            return (
                f"This format cannot carry {named}. What that costs is not known: robot.yaml declares no point.",
            )
        off = self.error.in_millimetres()
        carrying = f", carrying {self.payload:.3g} kg" if self.payload > 0 else ""
        alone = any(term.name in _CALIBRATED for term in self.terms)
        instead = ("A calibration with --terms kinematic makes up for a part of that by the geometry.",)
        return (
            f"This format cannot carry {named}.",
            *(instead if alone else ()),
            f"The tool is off by {off['mean_mm']:.3f} mm on average, {off['p95_mm']:.3f} mm in 95 % of poses and "
            f"{off['max_mm']:.3f} mm at most, over {self.poses} random poses of the {self.within}{carrying}.",
        )


def measure_export_error(
    model: RobotModel,
    tool: ToolMap,
    terms: Sequence[str],
    *,
    point: str | None = None,
    absorb: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> ExportErrors:
    """Error of a file that puts the target at `tool` and lacks `terms`; only those that `model` has count.

    The robot carries its declared payload. `absorb` takes joint positions (N, n) and what a term moves the tool by (N, 3), and returns
    what the file's own freedom leaves of it; by default all of it.
    """
    present = [term for term in terms if _leave_out(model, term) is not model]
    payload = model.payload_mass
    if not model.points:
        return ExportErrors(
            tuple(UnrepresentedTerm(term, None) for term in present), None, 0, "joint range", payload
        )
    q, within = random_poses(model, point, np.random.default_rng(0))
    full, flank = tool_positions(model, q, point=point)
    lost = []
    for term in present:
        moved = full - tool_positions(_leave_out(model, term), q, point=point, flank=flank)[0]
        lost.append(UnrepresentedTerm(term, PositionErrors.of(moved if absorb is None else absorb(q, moved))))
    return ExportErrors(tuple(lost), PositionErrors.of(full - tool(q)), len(q), within, payload)


def tool_positions(
    model: RobotModel, q: np.ndarray, *, point: str | None = None, flank: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Target positions (N, 3), m, of the robot at rest with all known terms, and the flanks (N, n) of its backlash."""
    rest = static_equilibrium(model, q, flank=flank)
    return point_kinematics(model, q, rest.deflection, point=point, jacobians=False).position, rest.flank


def random_poses(model: RobotModel, point: str | None, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    """Random joint positions (N, n) with the target in the declared working volume, or over the whole joint range without one.

    The second value says which. Where fewer than 50 of the tries reach the volume, it is the joint range, too.
    """
    lower, upper = joint_limits(model)
    slides = np.array([joint.kind == "prismatic" for joint in model.motor_joints])
    free = ~(upper - lower <= np.where(slides, np.finfo(float).max, _TURNS))
    reach = np.where(slides, _STROKE, np.pi)
    lower, upper = np.where(free, -reach, lower), np.where(free, reach, upper)
    box = model.config.working_volume
    if box is not None:
        targets = rng.uniform(box.lower, box.upper, (SAMPLES // _TRIES, 3))
        starts = rng.uniform(lower, upper, (_TRIES, len(targets), model.n))
        tried = [reach_points(model, targets, start, lower, upper, point=point) for start in starts]
        poses = np.concatenate([q[reached] for q, reached in tried])
        if len(poses) >= _LEAST_REACHED:
            return poses, "working volume"
    return random_configurations(model, SAMPLES, rng, lower, upper), "joint range"


def _leave_out(model: RobotModel, term: str) -> RobotModel:
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


def _alone(error: PositionErrors | None) -> str:
    if error is None:
        return ""
    errors = error.in_millimetres()
    return f" (alone {errors['mean_mm']:.3f} mm on average, {errors['max_mm']:.3f} mm at most)"
