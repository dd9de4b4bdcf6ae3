"""Sensitivity of measured poses to geometric errors: whitened Jacobian, reduced to base parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.design.scene import STANDARD, MeasuringSetup, station_position
from flexcal.errors import FlexcalError
from flexcal.estimation import Identifiability, Parameter, Parameters, Sensitivity, analyse
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import GEOMETRY, RobotModel, unit_in
from flexcal.model.statics import gravity_torque
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class GeometricTolerances:
    """Prior standard deviations (1σ) of geometric errors: lengths (m), angles and half gaps (rad), and the place of the instrument (m)."""

    length: float = 0.3 * MILLIMETRE
    angle: float = 0.5e-3
    station: float = 10 * MILLIMETRE

    def of(self, model: RobotModel, name: str) -> float:
        """Tolerance of a parameter by its name."""
        if name.startswith("station."):
            return self.station
        return self.angle if unit_in(model, name) == "rad" else self.length


BLOCK = 512
"""Number of poses whose rows are computed together, sized for the processor's cache."""
TYPICAL = GeometricTolerances()
"""Tolerances of a well-made industrial robot, and an instrument whose place was measured with a tape."""


def as_drawn(model: RobotModel) -> RobotModel:
    """Robot with the geometry of its URDF: axes that calibration made not quite parallel would show faintly what no instrument sees."""
    names = [*model.geometry_columns, *(f"tool.{key}" for key in GEOMETRY)]
    return model.with_values(dict.fromkeys(names, 0.0))


def geometry_jacobian(
    model: RobotModel, q: np.ndarray, setup: MeasuringSetup = STANDARD
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (p,) and derivatives (samples, 3, p), in m/rad and m/m, of the measured target position by every geometric error.

    The station's three offsets, six errors per joint, six of the tool, and the half gap of each joint with backlash: minus the sign of
    its gravity torque times its twist column. The arm is undeflected; the axes are the base's (the rank does not depend on the
    station's orientation). Raises `FlexcalError` for an unknown point or station.
    """
    station = setup.station or model.stations.names[0]
    motion = point_kinematics(model, q, point=setup.point)
    target = model.point(setup.point)
    names = [f"station.{station}.{axis}" for axis in "xyz"]
    names += list(model.geometry_columns)
    names += [f"tool.{key}" for key in GEOMETRY]
    if target.name != model.tool_point:
        names[-3:] = [f"point.{target.name}.{axis}" for axis in "xyz"]
    loose = list(model.backlash_joints)
    names += [f"{model.joints[i].name}.backlash" for i in loose]
    flank = np.sign(gravity_torque(model, q, setup.payload)[:, loose])
    slack = -flank[:, None, :] * motion.motion_jacobian[:, :3, loose, 2]
    place = np.broadcast_to(np.eye(3), (len(flank), 3, 3))
    return tuple(names), np.concatenate([place, motion.geometry_jacobian[:, :3], slack], axis=2)


def pose_sensitivity(
    model: RobotModel,
    q: np.ndarray,
    setup: MeasuringSetup = STANDARD,
    tolerances: GeometricTolerances = TYPICAL,
) -> Sensitivity:
    """Rows of every pose of `q` (samples, n) in the geometric errors (SI), whitened by the instrument's noise; prior: the tolerances.

    Where robot.yaml does not say where the instrument stands, its distance is taken as twice the robot's reach.
    """
    names, _ = geometry_jacobian(model, q[:1], setup)
    std = measuring_noise(model, q, setup)
    parameters = Parameters(
        Parameter(name, unit_in(model, name), 0.0, prior_std=tolerances.of(model, name)) for name in names
    )
    whitened = np.empty((len(q), 3, len(names)))
    for first in range(0, len(q), BLOCK):
        part = slice(first, first + BLOCK)
        whitened[part] = geometry_jacobian(model, q[part], setup)[1] / std[part, None, None]
    return Sensitivity(whitened, parameters, parameters.prior_information())


def measuring_noise(model: RobotModel, q: np.ndarray, setup: MeasuringSetup = STANDARD) -> np.ndarray:
    """Standard deviation (samples,), m, of the measured coordinates at `q` (samples, n)."""
    origin = station_position(model, setup.station)
    position = point_kinematics(model, q, point=setup.point, jacobians=False).position
    apart = np.full(len(q), 2 * model.reach) if origin is None else np.linalg.norm(position - origin, axis=1)
    return setup.noise.std(apart)


@dataclass(frozen=True, eq=False)
class BaseSensitivity:
    """Sensitivity in the parameter combinations that the candidates separate, each in units of the kept parameter's tolerance.

    `sensitivity` has jacobian (candidates, 3, rank) and the prior of the combinations; `identifiability` says what was kept and what
    absorbed the rest; `scale` (rank,) are the tolerances (rad, m). Only in such units do σ_min and O1-O5 mean anything. `tolerance` (p,)
    is that of every parameter before the reduction.
    """

    sensitivity: Sensitivity
    identifiability: Identifiability
    scale: np.ndarray
    tolerance: np.ndarray

    def with_prior(self, covariance: np.ndarray) -> BaseSensitivity:
        """The same combinations with another prior, of `covariance` (p, p) of the parameters before the reduction."""
        size = np.sqrt(np.diag(covariance))
        root = size[:, None] * np.linalg.cholesky(covariance / np.outer(size, size))
        information = _prior_information(self.identifiability.regrouping @ root / self.scale[:, None])
        known = Sensitivity(self.sensitivity.jacobian, self.sensitivity.parameters, information)
        return replace(self, sensitivity=known)

    def columns(self, jacobian: np.ndarray) -> np.ndarray:
        """Columns (..., rank) of a `jacobian` (..., p) by all parameters for these combinations, with the same scales."""
        return jacobian[..., list(self.identifiability.kept)] * self.scale


def base_sensitivity(full: Sensitivity) -> BaseSensitivity:
    """Reduce a sensitivity to the combinations that its candidates determine: pivoted QR (Gautier 1991) on prior-scaled columns.

    The regrouped prior covariance is G S² Gᵀ, with G the regrouping and S the tolerances. Raises `FlexcalError` where a parameter has no
    finite prior to be its scale.
    """
    tolerance = full.parameters.prior_std()
    if not np.all(np.isfinite(tolerance)):
        name = full.parameters.names[int(np.argmin(np.isfinite(tolerance)))]
        raise FlexcalError(
            "E-DESIGN-025",
            f"{name} has no tolerance; give every parameter a finite prior_std, it sets the scale.",
        )
    # σ_min has a meaning in declared units only: the station is scaled like any other length
    scale = np.where([p.unit == "m" for p in full.parameters], _length_scale(full.parameters), tolerance)
    identifiability = analyse(_triangle(full.jacobian), full.parameters.names, scale=scale)
    kept = list(identifiability.kept)
    information = _prior_information(identifiability.regrouping * tolerance / scale[kept][:, None])
    parameters = Parameters(Parameter(name, "1", 0.0) for name in identifiability.kept_names)
    sensitivity = Sensitivity(full.jacobian[:, :, kept] * scale[kept], parameters, information)
    return BaseSensitivity(sensitivity, identifiability, scale[kept], tolerance)


def _prior_information(spread: np.ndarray) -> np.ndarray:
    """Information (rank, rank) of combinations whose prior covariance is spread · spreadᵀ, with `spread` (rank, p)."""
    factor = np.linalg.qr(spread.T, mode="r")
    root = np.linalg.solve(factor, np.eye(len(spread)))
    return root @ root.T


def _triangle(jacobian: np.ndarray) -> np.ndarray:
    """Rows of a `jacobian` (candidates, r, p) if they are few, else a factor R (p, p) with the same RᵀR, computed block by block."""
    if len(jacobian) <= 16 * BLOCK:
        return jacobian.reshape(-1, jacobian.shape[2])
    factor = np.zeros((0, jacobian.shape[2]))
    for first in range(0, len(jacobian), BLOCK):
        rows = jacobian[first : first + BLOCK].reshape(-1, jacobian.shape[2])
        factor = np.asarray(np.linalg.qr(np.vstack([factor, rows]), mode="r"))
    return factor


def _length_scale(parameters: Parameters) -> float:
    lengths = [p.prior_std for p in parameters if p.unit == "m" and not p.name.startswith("station.")]
    return min(lengths, default=TYPICAL.length)
