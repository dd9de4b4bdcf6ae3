"""Where a calibration holds: predicted errors near its poses, and where the robot will work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import predicted_rms, random_poses_in
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import propagation
from flexcal.errors import FlexcalError
from flexcal.jobs.calibration.joint_ranges import joint_extents
from flexcal.jobs.inputs import PREDICTED
from flexcal.model.kinematics import joint_ranges, point_kinematics, rigid_motion_columns
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest
from flexcal.report.checks import BEYOND
from flexcal.report.layout import listed
from flexcal.units import MILLIMETRE

_POSES = 300
"""Random poses at which errors are predicted."""
_WHOLE = 0.8
"""Share of a joint's range from which the poses have the whole of it."""


@dataclass(frozen=True, eq=False)
class Extent:
    """Predicted errors, m (root mean square), `inside`, at the poses of a fit, and `beyond`, over the declared working `volume` or, without
    one, the joints' ranges.

    `ranges` of the joints at the poses, of those that moved through a part of their range only; `box` (2, 3), m, base frame, around the
    points. `corrected`, m, is what the calibration changes beyond (root mean square), base and point found; None where no instrument
    measured points.
    """

    inside: float
    beyond: float
    volume: bool
    ranges: Mapping[str, str]
    box: np.ndarray
    corrected: float | None

    @classmethod
    def of(cls, fit: GeometricFit) -> Extent | None:
        """Extent of a fit to points; None where nothing moves a point, or a slide has no limits."""
        poses = fit.poses.pointed
        if not len(poses):
            return None
        target = str(poses.target[0])
        model = fit.model
        corners = model.config.working_volume
        box = None if corners is None else np.array([corners.lower, corners.upper])
        rng = np.random.default_rng(0)
        try:
            reach = propagation(model, target=target)
            q = random_poses_in(reach, _POSES, rng, box)
        except FlexcalError:
            return None
        own = poses.q[poses.target == target]
        inside = own[rng.permutation(len(own))[:_POSES]]
        points = point_kinematics(model, inside, point=target, jacobians=False).position
        around = np.array([points.min(axis=0), points.max(axis=0)])
        rms = [float(np.sqrt(np.mean(predicted_rms(reach, at) ** 2))) for at in (inside, q)]
        corrected = _corrected(fit, q, target)
        return cls(rms[0], rms[1], box is not None, _partial_ranges(model, own), around, corrected)

    @property
    def range_of_errors(self) -> dict[str, tuple[float, float]]:
        """Entry of the ranges of an estimate."""
        return {PREDICTED: (self.inside, self.beyond)}

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "inside_mm": self.inside / MILLIMETRE,
            "beyond_mm": self.beyond / MILLIMETRE,
            "corrected_mm": None if self.corrected is None else self.corrected / MILLIMETRE,
            "of": "working volume" if self.volume else "joint ranges",
        }

    @property
    def remarks(self) -> tuple[str, ...]:
        """Where the calibration holds, if not where the robot will work."""
        if self.beyond <= BEYOND * self.inside:
            return ()
        where = "the working volume" if self.volume else "the joints' ranges"
        sides = (f"{name} {low:.2f} to {high:.2f}" for name, low, high in zip("xyz", *self.box, strict=True))
        ranges = [f"{name} {told}" for name, told in self.ranges.items()]
        near = f"{listed(ranges, len(ranges))}; " if ranges else ""
        otherwise = (
            "" if self.volume else ", or declare `working_volume:` in robot.yaml if it works in a part"
        )
        return (
            f"accurate only near these poses ({near}the point in {', '.join(sides)} m): predicted errors are {_mm(self.inside)} there and "
            f"{_mm(self.beyond)} over {where} (rms); calibrate on poses of where the robot works{otherwise}",
        )


def _corrected(fit: GeometricFit, q: np.ndarray, target: str) -> float:
    """Root mean square change, m, of points at poses `q` (N, n) by a fit, without what other places of base and point explain."""
    parameters = fit.estimate.parameters
    start = dict(zip(parameters.names, parameters.natural(parameters.prior_mean()).tolist(), strict=True))
    nominal, calibrated = (
        tool_at_rest(model, q, None, np.full(len(q), target)).kinematics
        for model in (fit.model.with_values(start), fit.model)
    )
    moved = (calibrated.position - nominal.position).ravel()
    gauge = np.concatenate([rigid_motion_columns(nominal.position), nominal.orientation], axis=2)
    gauge = gauge.reshape(len(moved), -1)
    moved -= gauge @ np.linalg.lstsq(gauge, moved, rcond=None)[0]
    return float(np.linalg.norm(moved) / np.sqrt(len(q)))


def _mm(size: float) -> str:
    return f"{size / MILLIMETRE:.2g} mm"


def _partial_ranges(model: RobotModel, q: np.ndarray) -> dict[str, str]:
    """Ranges of the joints at poses `q` (N, n) that do not reach over most of what the joint can."""
    whole = np.subtract(*joint_ranges(model)[::-1])
    told = {}
    for (name, (low, high)), full in zip(joint_extents(model, q).items(), whole, strict=True):
        if high - low < _WHOLE * min(full, 2 * np.pi):
            turns = model.joints[model.joint_index(name)].kind == "revolute"
            told[name] = (
                f"{np.degrees(low):.0f} to {np.degrees(high):.0f}°" if turns else f"{low:.3f} to {high:.3f} m"
            )
    return told
