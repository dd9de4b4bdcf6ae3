"""Coupled drives that robot.yaml does not declare, or with another ratio: joints whose errors are the motion of another motor."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.calibration.fit import TOLERANCE, GeometricFit, fit_geometry, plausible_size
from flexcal.calibration.kinds import wrong_readings
from flexcal.calibration.measurement import predict_measurements, predicted_positions, register
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import motor_motion
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_EXPLAINED = 0.75
"""Share of the squared residuals that one ratio has to explain, to first order, to be tried."""
_BETTER = 1 / 3
"""Ratio of the residuals with the coupling to those without, below which it is what is wrong."""
_AS_GOOD = 1.5
"""Ratio of the residuals with one ratio to those with transmission errors of all joints, up to which it is as good an explanation."""
_ROUNDS = 3
_LEAST = 12
"""Fewest points beyond the parameters at which a ratio is not chance."""


@dataclass(frozen=True)
class Coupling:
    """Motor `other` that moves `joint` too, by `ratio` in all: residuals (root mean square distance, m) `before`, and `after` with it."""

    joint: str
    other: str
    ratio: float
    unit: str
    before: float
    after: float
    declaration: str

    @property
    def sentence(self) -> str:
        """What robot.yaml lacks."""
        own = self.joint == self.other
        what = (
            f"{self.joint} moves {self.ratio:.5g} times as far as the file says"
            if own
            else f"the motor of {self.other} moves {self.joint} too, by {self.ratio:.4g} {self.unit}".rstrip()
        )
        remedy = "correct its unit or `signals:`, or declare" if own else "declare"
        return (
            f"{what}: with that the points are met to {self.after / MILLIMETRE:.3g} mm (rms) instead of {self.before / MILLIMETRE:.3g}; "
            f"{remedy} {self.declaration} in robot.yaml, and calibrate again"
        )

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "joint": self.joint,
            "motor": self.other,
            "ratio": self.ratio,
            "before_mm": self.before / MILLIMETRE,
            "after_mm": self.after / MILLIMETRE,
        }


def undeclared_coupling(nominal: RobotModel, fit: GeometricFit) -> Coupling | None:
    """The ratio of a motor to a joint that explains most of a bad fit to points; None where the fit is good or no single one does.

    A fit with implausibly large transmission errors is bad, too: over a part of a turn waves follow a joint of a wrong ratio.
    Of such a fit the ratio alone has to meet the points nearly as well as the waves do.

    The best of all pairs to first order is tried, else the best with a ratio of ±1: with it, the geometry is fitted anew, and has to meet
    the points three times as well. Orientations do not count, and views of a camera, which scatter by more than a bad fit, are not judged.
    """
    near = ~wrong_readings(np.linalg.norm(fit.residuals, axis=1))
    poses, left = fit.poses.without_orientations().subset(near), _size(fit.residuals[near])
    small = left < np.sqrt(3) * TOLERANCE["m"]
    if (
        (small and not _large_waves(fit))
        or poses.kind is not None
        or poses.seen.any()
        or not poses.located.all()
    ):
        return None
    try:
        first = fit_geometry(nominal, poses, terms=("kinematic",), loss="squares")
    except FlexcalError:
        # fewer readings than parameters
        return None
    if 3 * len(poses) < len(first.identifiability.kept_names) + _LEAST:
        return None
    gains, ratios = _explained(first)
    joint, motor = (int(k) for k in np.unravel_index(int(np.argmax(gains)), gains.shape))
    start = float(ratios[joint, motor])
    if gains[joint, motor] < _EXPLAINED:
        if small:
            return None
        every = _one_to_one(nominal)
        sizes = [_registered(_coupled(nominal, *tried), poses) for tried in every]
        joint, motor, start = every[int(np.argmin(sizes))]
    model = _coupled(nominal, joint, motor, start)
    found = fit_geometry(model, poses, terms=("kinematic",), loss="squares")
    for _ in range(_ROUNDS):
        model = _coupled(model, joint, motor, float(_explained(found)[1][joint, motor]))
        found = fit_geometry(model, poses, terms=("kinematic",), loss="squares")
    before, after = _size(first.residuals), _size(found.residuals)
    enough = after < _BETTER * before and (not small or after < _AS_GOOD * left)
    return _told(model, joint, motor, before, after) if enough else None


def _large_waves(fit: GeometricFit) -> bool:
    """Whether a transmission error is larger than those of drives are."""
    values = fit.estimate.values
    return any(abs(values[n]) > plausible_size(fit.model, n) for n in values if ".transmission_" in n)


def _one_to_one(model: RobotModel) -> list[tuple[int, int, float]]:
    """All pairs of joint and motor with the ratios of gear pairs and parallelograms."""
    pairs = itertools.permutations(range(model.n), 2)
    return [(joint, motor, ratio) for joint, motor in pairs for ratio in (1.0, -1.0)]


def _registered(model: RobotModel, poses: PoseSet) -> float:
    """Root mean square distance, m, of the measured points from those of a best-fit registered robot."""
    rigid = predicted_positions(model, poses, elastic=False)
    return _size(poses.position - predicted_positions(register(model, poses, rigid), poses, elastic=False))


def _size(residuals: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))


def _explained(fit: GeometricFit) -> tuple[np.ndarray, np.ndarray]:
    """Share of the squared residuals that a ratio explains beside the geometry, and that ratio, (n, n), by joint and by motor."""
    model, poses = fit.model, fit.poses
    at = predict_measurements(model, poses, jacobians=True)
    names = list(fit.identifiability.kept_names)
    basis = np.linalg.qr(at.jacobian(names).reshape(-1, len(names)))[0]
    left = at.residual.reshape(-1)
    left = left - basis @ (basis.T @ left)
    moved = at.jacobian([f"{name}.offset" for name in model.motor_names])
    columns = (moved[:, :, :, None] * poses.q[:, None, None, :]).reshape(len(left), -1)
    columns -= basis @ (basis.T @ columns)
    square, along = np.sum(columns**2, axis=0), columns.T @ left
    seen = square > 1e-12 * square.max()
    ratios = np.divide(along, square, out=np.zeros_like(along), where=seen)
    shape = (model.n, model.n)
    return (ratios * along / float(left @ left)).reshape(shape), ratios.reshape(shape)


def _coupled(model: RobotModel, joint: int, motor: int, ratio: float) -> RobotModel:
    """Robot whose motor moves a joint by a further `ratio`; both count the motors."""
    errors = model.drives.ratio_error.copy()
    errors[model.motors[joint], model.motors[motor]] += ratio
    return replace(model, drives=replace(model.drives, ratio_error=errors))


def _told(model: RobotModel, joint: int, motor: int, before: float, after: float) -> Coupling:
    i, k = model.motors[joint], model.motors[motor]
    relations, names = model.relations, model.joint_names
    of = {names[i]: float(motor_motion(model)[i, joint])}
    if relations is not None:
        of |= {names[j]: float(relations.ratios[i, j]) for j in np.flatnonzero(relations.ratios[i])}
    of[names[k]] = of.get(names[k], 0.0) + float(model.drives.ratio_error[i, k])
    listed = ", ".join(f"{name}: {ratio:.5g}" for name, ratio in of.items())
    kinds = model.joints[i].kind, model.joints[k].kind
    unit = "" if kinds[0] == kinds[1] else "m/rad" if kinds[0] == "prismatic" else "rad/m"
    declaration = f"`relations: [{{joint: {names[i]}, of: {{{listed}}}}}]`"
    return Coupling(names[i], names[k], of[names[k]], unit, before, after, declaration)
