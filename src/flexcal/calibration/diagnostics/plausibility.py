"""Plausibility of a fit from the change of its parameters: data with a wrong sign or unit can be fitted perfectly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import TOLERANCE, GeometricFit, base_errors, manufacturing_tolerances
from flexcal.calibration.measurement import predict_measurements
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel

FAR = 50.0
"""Largest plausible deviation of a geometric parameter, in tolerances: 15 mm, 25 mrad."""

FAR_POINT = 0.05
"""Largest plausible deviation, m, of a reflector's place on the tool, which is often guessed."""

FAR_FROM_PRIOR = 5.0
"""Largest plausible deviation of a stiffness, mass or centre of mass, in standard deviations of its prior."""

NOISY = 3.0
"""Ratio of errors after the fit to the known noise of a camera's single views below which they are that noise."""

FAR_ZERO = 0.6
"""Largest plausible error of a joint zero, rad, where the residuals are plausible: zeros that were set by eye."""

PLAY = 6e-3
"""Error after the fit, m (root mean square of a coordinate), up to which play in the joints of small arms explains it."""

SCATTERED = 0.01
"""Ratio of errors after the fit to the extent of the points (root mean square both) from which data and robot do not belong together."""


@dataclass(frozen=True)
class ImplausibleShift:
    """Parameter that changed to `value`, by `times` its tolerance (or the standard deviation of its prior)."""

    name: str
    start: float
    value: float
    unit: str
    times: float


def is_implausible(calibration: GeometricFit) -> bool:
    """Whether data and robot are inconsistent, so that the fit must not be used."""
    return bool(implausible_shifts(calibration)) or residuals_implausible(calibration)


def residuals_implausible(calibration: GeometricFit) -> bool:
    """Whether the residuals, without outliers, are larger than plausible for any robot."""
    rows = ~np.isin(np.arange(len(calibration.poses)), calibration.estimate.outliers)
    position = _in_base(calibration)[rows]
    extent = np.sqrt(np.mean((position - position.mean(axis=0)) ** 2))
    size = float(np.sqrt(np.mean(calibration.residuals[rows] ** 2)))
    noise = np.where(calibration.poses.seen[:, None], calibration.poses.sigma, 0.0)[rows]
    return size > max(SCATTERED * extent, PLAY) and size > NOISY * float(np.sqrt(np.mean(noise**2)))


def _in_base(calibration: GeometricFit) -> np.ndarray:
    """Measured points (N, 3), m, in the robot's base frame, where the stations are as fitted; predicted ones where some were not."""
    model, poses = calibration.model, calibration.poses
    if poses.kind is not None:
        return predict_measurements(model, poses, elastic=False).kinematics.position
    result = np.empty_like(poses.position)
    for station in poses.stations:
        own, place = poses.station == station, model.stations.pose[model.station_index(station)]
        result[own] = (poses.position[own] - place[:3]) @ vector_rotation(place[3:])
    return result


def implausible_shifts(calibration: GeometricFit) -> tuple[ImplausibleShift, ...]:
    """Parameters with an implausibly large change from their start values, the largest first.

    Where the residuals are plausible, beyond what the noise of the estimate (2σ) explains. Beside a fixture, whose place starts from the
    nominal robot at a few poses, errors of the first joint that another place of the robot looks like say where the instruments stand.
    """
    estimate, prior = calibration.estimate.parameters, calibration.prior
    placed = base_errors(calibration.model) if calibration.poses.in_socket.any() else ()
    kept = [name for name in calibration.identifiability.kept_names if _has_size(name) and name not in placed]
    named = [*kept, *prior.parameters.names]
    end, start = estimate.subset(named).coordinates(), estimate.subset(named).prior_mean()
    shifts = _shifts(calibration)
    end[: len(kept)] = start[: len(kept)] + [shifts[name][0] for name in kept]
    size = np.concatenate(
        [manufacturing_tolerances(estimate.subset(kept)), np.sqrt(np.diag(prior.covariance))]
    )
    limits, noise = _limits(kept, size), np.zeros(len(named))
    if not residuals_implausible(calibration):
        noise[: len(kept)] = [shifts[name][1] for name in kept]
        if calibration.poses.located.all():
            zeros = np.array([name in _zeros(calibration.model) for name in kept], dtype=bool)
            limits = np.where(zeros, FAR_ZERO / size[: len(kept)], limits)
    limit = np.concatenate([limits, np.full(len(prior.parameters), FAR_FROM_PRIOR)])
    times = np.abs(end - start) / size
    clear = times - 2 * noise / size
    far = [k for k in np.argsort(-times / limit) if clear[k] > limit[k]]
    items = [(estimate[named[k]], float(start[k]), float(end[k]), float(times[k])) for k in far]
    return tuple(ImplausibleShift(p.name, p.natural(x), p.natural(y), p.unit, t) for p, x, y, t in items)


def _shifts(calibration: GeometricFit) -> dict[str, tuple[float, float]]:
    """Change of each kept parameter, natural units, with its standard deviation.

    Where priors leave the dropped ones free they share its change, and one wrong length is none that is far off: it has theirs too.
    """
    seen, estimate = calibration.identifiability, calibration.estimate
    places = {name: k for k, name in enumerate(estimate.parameters.names)}
    alike = [k for k, name in enumerate(seen.names) if name in places and _has_size(name)]
    items = estimate.parameters.subset([seen.names[k] for k in alike])
    regrouping = seen.regrouping[:, alike]
    rows = [places[item.name] for item in items]
    spread = regrouping @ estimate.covariance[np.ix_(rows, rows)] @ regrouping.T
    shift = regrouping @ (items.coordinates() - items.prior_mean())
    stds = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return dict(zip(seen.kept_names, zip(shift.tolist(), stds.tolist(), strict=True), strict=True))


def _limits(kept: list[str], size: np.ndarray) -> np.ndarray:
    """Largest plausible change of each geometric parameter, in tolerances."""
    points = [name.startswith(("tool.length", "point.")) for name in kept]
    return np.where(points, FAR_POINT / size[: len(kept)], FAR)


def _zeros(model: RobotModel) -> tuple[str, ...]:
    return tuple(f"{joint.name}.offset" for joint in model.joints if joint.kind == "revolute")


@dataclass(frozen=True)
class FarZero:
    """Joint whose zero is far from that of the URDF, by the `error` with the half width of its 95 % interval, rad."""

    joint: str
    error: float
    half_width: float

    def __str__(self) -> str:
        return f"{self.joint} {np.rad2deg(self.error):+.1f} ± {np.rad2deg(self.half_width):.1f}°"


def far_zeros(calibration: GeometricFit) -> tuple[FarZero, ...]:
    """Joint zeros that are farther off than tolerances of manufacture explain, the farthest first."""
    found, estimate = [], calibration.estimate
    for joint in calibration.model.joints:
        name = f"{joint.name}.offset"
        # what the first joint is off is where the base is
        if joint.kind != "revolute" or joint.parent < 0 or name not in estimate.parameters.names:
            continue
        interval, start = estimate.interval(name), estimate.parameters.subset([name]).prior_mean()
        error = estimate.values[name] - float(start[0])
        if interval is not None and abs(error) > FAR * TOLERANCE["rad"]:
            found.append(FarZero(joint.name, error, (interval[1] - interval[0]) / 2))
    return tuple(sorted(found, key=lambda zero: -abs(zero.error)))


def _has_size(name: str) -> bool:
    """Whether robot.yaml or the URDF give a parameter's size: not for the place of the instrument, how a target's axes are mounted, nor
    for a compliance.
    """
    mounted = name.startswith("point.") and name.endswith(("rx", "ry", "rz"))
    return (
        not mounted
        and not name.startswith(("station.", "sockets.", "wires."))
        and ".gravity_compliance" not in name
    )
