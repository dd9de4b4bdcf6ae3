"""From which side the joints came to the poses of a calibration, and what a program that comes from the other side is off by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.calibration.fit import GeometricFit, moving_joints, plausible_size
from flexcal.calibration.measurement import lag_rms
from flexcal.calibration.verification import prediction_errors
from flexcal.data.poses import PoseSet
from flexcal.model.robot import HYSTERESIS, RobotModel
from flexcal.model.statics import points_kinematics
from flexcal.report.layout import listed
from flexcal.units import MILLIMETRE

_WORTH = 0.5
"""Error from the other side, relative to the mean error at the poses of the fit, from which it has a sentence."""
_OTHERWISE = 1.2
"""Ratio of the error from any side to that from the sides of a verification from which it has a sentence."""
_CERTAINLY = 3.0
"""Standard deviations from which a joint that leads its motor is a finding."""
_MOVED, _FEW = 1e-3, 0.1
"""Motion of a joint, rad, and the share of the moves in either direction from which it came to the poses from both sides."""
_SHOWN = 3


@dataclass(frozen=True, eq=False)
class Approaches:
    """Joints that came to the poses of a `fit` from `both` sides, from `one`, and from one that is `unknown`.

    `other_side`, m: root mean square by which the points move if the joints that are not of `both` come from the other side.
    """

    fit: GeometricFit
    both: tuple[str, ...]
    one: tuple[str, ...]
    unknown: tuple[str, ...]
    other_side: float

    @classmethod
    def of(cls, fit: GeometricFit) -> Approaches | None:
        """Approaches to the poses of a fit; None without points."""
        model, poses = fit.model, fit.poses.pointed
        if not len(poses):
            return None
        signs = np.zeros(poses.q.shape) if poses.approach is None else poses.approach
        from_sides = (signs == 1).any(axis=0).astype(int) + (signs == -1).any(axis=0)
        sides = {
            i: int(from_sides[model.motors.index(i)])
            for i in moving_joints(model, poses)
            if i in model.motors and model.joints[i].kind == "revolute"
        }
        lag, missing = lag_rms(model), [i for i in sides if sides[i] < 2]
        half = [lag[i] or plausible_size(model, f"{model.joints[i].name}.{HYSTERESIS}") for i in missing]
        at = points_kinematics(model, poses.q, None, poses.target, jacobians=True)
        moved = 2 * at.motion_jacobian[:, :3, missing, 2] * np.array(half)
        unknown, one, both = (
            tuple(model.joints[i].name for i in sides if sides[i] == count) for count in range(3)
        )
        return cls(fit, both, one, unknown, float(np.sqrt((moved**2).sum(axis=(1, 2)).mean())))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a program must expect that comes from another side than the poses of the fit."""
        remarks = []
        if leading := self._leading():
            remarks.append(
                f"the arm leads its motors by {listed(leading, _SHOWN)}, where gears lag behind: the signs in the columns approach1… may "
                "be reversed (1 is a last motion in the positive direction)"
            )
        if self.other_side < _WORTH * self.fit.errors.mean:
            return tuple(remarks)
        size = (
            f"is off by about {self.other_side / MILLIMETRE:.2g} mm more (rms, from hysteresis of gears, whose half width is 15 to 145 "
            "µrad)"
        )
        if self.one:
            remarks.append(
                f"{listed(self.one, _SHOWN)} came from one side at all poses, so their zeros have half the width of a hysteresis in them: "
                f"a program that comes from the other side {size}; predicted errors have it in them; plan poses from both sides with "
                "'flexcal design poses'"
            )
        elif self.unknown:
            remarks.append(
                f"the files do not say from which side the joints came (columns approach1…): if always from the same, a program that comes "
                f"from the other {size}, which is in no predicted error{self._by_order()}"
            )
        return tuple(remarks)

    def _by_order(self) -> str:
        """Clause on poses that were reached straight from those before them, if rows are in the order of measuring."""
        q = self.fit.poses.pointed.q
        joints = [name in self.unknown for name in (joint.name for joint in self.fit.model.motor_joints)]
        moves = np.diff(q[:, joints], axis=0)
        rarer = np.minimum((moves > _MOVED).mean(axis=0), (moves < -_MOVED).mean(axis=0))
        if rarer.min() < _FEW:
            return ""
        return "; if the robot went straight from row to row, they came from both, and it is in the scatter"

    def _leading(self) -> tuple[str, ...]:
        """Clauses on joints whose half width is negative beyond three standard deviations."""
        estimate, told = self.fit.estimate, []
        for joint in self.both:
            name = f"{joint}.{HYSTERESIS}"
            std = estimate.std(name)
            if std is not None and estimate.values[name] < -_CERTAINLY * std:
                told.append(
                    f"{-1e6 * estimate.values[name]:.0f} {estimate.spread(name, 1e6)} µrad at {joint}"
                )
        return tuple(told)

    def document(self) -> dict[str, Any]:
        """Block `approach` of results.json."""
        return {
            "both_sides": list(self.both),
            "one_side": list(self.one),
            "unknown": list(self.unknown),
            "other_side_mm": self.other_side / MILLIMETRE,
        }


def other_sides_remark(model: RobotModel, poses: PoseSet, expected: np.ndarray) -> tuple[str, ...]:
    """Remark on the sides for which errors at `poses` were predicted as `expected` (N,), m, where it matters."""
    if not lag_rms(model).any():
        return ()
    if poses.approach is None:
        return (
            "the files do not say from which side the joints came (columns approach1…), so that all may have come from any, and what is "
            "predicted has hysteresis of gears in it",
        )
    anywhere = prediction_errors(model, replace(poses, approach=None)).expected_rms
    there, here = (float(np.sqrt(np.mean(size**2))) for size in (anywhere, expected))
    if there < _OTHERWISE * here:
        return ()
    return (
        f"{here / MILLIMETRE:.3f} mm rms are predicted for joints that come from the sides that these files say, and "
        f"{there / MILLIMETRE:.3f} mm where a program comes from any side",
    )
