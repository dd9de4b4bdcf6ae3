"""Plausibility of a fit from the change of its parameters: data with a wrong sign or unit can be fitted perfectly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.calibration.fit import (
    TOLERANCE,
    GeometricFit,
    base_errors,
    manufacturing_tolerances,
    point_uncertainty,
)
from flexcal.calibration.measurement import predict_measurements
from flexcal.estimation import Parameter, Parameters
from flexcal.model.kinematics import found_xyz
from flexcal.model.parts import vector_rotation

FAR = 50.0
"""Largest plausible deviation of a geometric parameter, in tolerances: 15 mm, 25 mrad."""

FAR_POINT = 0.05
"""Largest plausible deviation, m, of a reflector's place on the tool, which is often guessed."""

FAR_FROM_PRIOR = 5.0
"""Deviation of a stiffness, mass or centre of mass, in standard deviations of its prior, from which points and prior do not agree."""

NOISY = 3.0
"""Ratio of errors after the fit to the known noise of a camera's single views below which they are that noise."""

FAR_ZERO = 0.6
"""Largest plausible error of a joint zero that was set by eye, rad, where the residuals are plausible."""

PLAY = 6e-3
"""Error after the fit, m (root mean square of a coordinate), up to which play in the joints of small arms explains it."""

SCATTERED = 0.01
"""Ratio of errors after the fit to the extent of the points (root mean square both) from which data and robot do not belong together."""

_POINTS = ("tool.", "point.")
"""Parameters of where points are on the tool."""
_OF_INSTRUMENTS = (*_POINTS, "station.", "sockets.", "wires.", "board.", "camera.")
_WAVE = ".transmission_"
_SAME = 1e-9
"""Relative singular value below which places look the same."""


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
    size = float(np.sqrt(np.mean(calibration.residuals[rows] ** 2)))
    noise = np.where(calibration.poses.seen[:, None], calibration.poses.sigma, 0.0)[rows]
    return size > max(_shown(calibration), PLAY) and size > NOISY * float(np.sqrt(np.mean(noise**2)))


def _shown(calibration: GeometricFit) -> float:
    """Error or displacement of a coordinate of the points, m (root mean square), that is a hundredth of their extent."""
    rows = ~np.isin(np.arange(len(calibration.poses)), calibration.estimate.outliers)
    position = _in_base(calibration)[rows]
    extent = np.sqrt(np.mean((position - position.mean(axis=0)) ** 2))
    return SCATTERED * float(extent)


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


@lru_cache(maxsize=1)
def implausible_shifts(calibration: GeometricFit) -> tuple[ImplausibleShift, ...]:
    """Parameters with an implausibly large change from their start values, the largest first, and far places of points.

    Where the residuals are plausible, beyond what the noise of the estimate (2σ) explains, and beside `far_zeros`. A change that moves the
    measured points by no more than is plausible is none, and neither is what another place of the base or of a point looks like.
    """
    estimate = calibration.estimate.parameters
    plausible = not residuals_implausible(calibration)
    regrouped = _regrouped_shifts(calibration, without_zeros=plausible)
    waves = [name for name in calibration.prior.parameters.names if _WAVE in name]
    names = [name for name in calibration.identifiability.kept_names if _has_size(name)]
    kept = estimate.subset([*names, *waves])
    shift = {p.name: float(d) for p, d in zip(estimate, _changes(estimate), strict=True)}
    shift |= {name: regrouped[name][0] for name in names}
    sizes = dict(zip(kept.names, manufacturing_tolerances(kept).tolist(), strict=True))
    noise = {name: 0.0 for name in kept.names}
    if plausible:
        noise |= {name: regrouped[name][1] for name in names}
        noise |= {name: calibration.estimate.std(name) or 0.0 for name in waves}
    far = [n for n in kept.names if abs(shift[n]) - 2 * noise[n] > FAR * sizes[n]]
    found = [_shifted(estimate[n], shift[n], abs(shift[n]) / sizes[n]) for n in far]
    found += deviations_from_prior(calibration)
    moved = displacements(calibration, {s.name: shift[s.name] for s in found})
    least = _shown(calibration)
    found = [s for s, own in zip(found, moved, strict=True) if own > least]
    found.sort(key=lambda s: -s.times / (FAR if s.name in far else FAR_FROM_PRIOR))
    return (*found, *_far_points(calibration))


def _regrouped_shifts(calibration: GeometricFit, *, without_zeros: bool) -> dict[str, tuple[float, float]]:
    """Change of each kept parameter, natural units, with its standard deviation, `without_zeros` that were set by eye.

    Where priors leave the dropped ones free they share its change, and one wrong length is none that is far off: it has theirs too.
    """
    seen, estimate = calibration.identifiability, calibration.estimate
    places = {name: k for k, name in enumerate(estimate.parameters.names)}
    alike = [k for k, name in enumerate(seen.names) if name in places and _has_size(name)]
    items = estimate.parameters.subset([seen.names[k] for k in alike])
    regrouping = seen.regrouping[:, alike]
    rows = [places[item.name] for item in items]
    spread = regrouping @ estimate.covariance[np.ix_(rows, rows)] @ regrouping.T
    changes = items.coordinates() - items.prior_mean()
    by_eye = [zero for zero in far_zeros(calibration) if abs(zero.error) <= FAR_ZERO] if without_zeros else ()
    for zero in by_eye:
        changes[items.index(f"{zero.joint}.offset")] = 0.0
    shift = regrouping @ changes
    stds = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return dict(zip(seen.kept_names, zip(shift.tolist(), stds.tolist(), strict=True), strict=True))


def deviations_from_prior(calibration: GeometricFit) -> list[ImplausibleShift]:
    """Stiffnesses, masses and centres of mass that the points put far from their prior, beyond 5 of its standard deviations."""
    prior = calibration.prior
    items = calibration.estimate.parameters.subset(prior.parameters.names)
    shift, size = _changes(items), np.sqrt(np.diag(prior.covariance))
    found = [_shifted(p, float(d), float(abs(d) / s)) for p, d, s in zip(items, shift, size, strict=True)]
    return [s for s in found if s.times > FAR_FROM_PRIOR and _has_size(s.name) and _WAVE not in s.name]


def _changes(items: Parameters) -> np.ndarray:
    """Changes (p,) of parameters from their start values, in estimation coordinates."""
    return items.coordinates() - items.prior_mean()


def _shifted(item: Parameter, shift: float, times: float) -> ImplausibleShift:
    """Parameter that changed by `shift` from its start value, in its estimation coordinate."""
    start = float(Parameters([item]).prior_mean()[0])
    return ImplausibleShift(item.name, item.natural(start), item.natural(start + shift), item.unit, times)


def displacements(calibration: GeometricFit, changes: Mapping[str, float]) -> np.ndarray:
    """Displacement (k,) of a coordinate of the measured points, m (root mean square), by each of the `changes` of parameters (in their
    estimation coordinates), to first order.

    Without what other places of base and points explain. A rad counts as the reach of the robot.
    """
    if not changes:
        return np.zeros(0)
    names = list(changes)
    estimate, model = calibration.estimate.parameters, calibration.model
    at = predict_measurements(model, calibration.poses, elastic=bool(model.elastic), jacobians=True)
    lever = np.repeat(np.where(at.readings.points, 1.0, model.reach), 3)
    rows = (at.readings.present & ~np.isin(at.readings.row, calibration.estimate.outliers)[:, None]).ravel()

    def columns(of: Sequence[str]) -> np.ndarray:
        return (at.jacobian(of).reshape(len(lever), -1) * lever[:, None])[rows]

    base = base_errors(model)
    places = [name for name in estimate.names if name.startswith(_POINTS) or name in base]
    own = estimate.subset(names)
    moved = columns(names) * own.natural_slope(own.coordinates()) * np.array(list(changes.values()))
    gauge = columns(places)
    gauge = gauge / np.maximum(np.linalg.norm(gauge, axis=0), np.finfo(float).tiny)
    moved -= gauge @ np.linalg.lstsq(gauge, moved, rcond=_SAME)[0]
    return np.sqrt(np.mean(moved**2, axis=0))


def _far_points(calibration: GeometricFit) -> list[ImplausibleShift]:
    """Coordinates of measured points in their frames that are implausibly far from where robot.yaml has them."""
    found = []
    for target in calibration.poses.pointed.targets:
        declared = calibration.model.points[target].xyz
        shifts = found_xyz(calibration.model, target) - declared
        found += [
            ImplausibleShift(
                f"point.{target}.{axis}", float(x), float(x + d), "m", abs(float(d)) / TOLERANCE["m"]
            )
            for axis, x, d in zip("xyz", declared, shifts, strict=True)
            if abs(d) > FAR_POINT + 2 * point_uncertainty(calibration.model, target)
        ]
    return found


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
        if interval is None:
            continue
        half = (interval[1] - interval[0]) / 2
        if abs(error) > max(FAR * TOLERANCE["rad"], half):
            found.append(FarZero(joint.name, error, half))
    return tuple(sorted(found, key=lambda zero: -abs(zero.error)))


def _has_size(name: str) -> bool:
    """Whether robot.yaml, the URDF or stage 1 give a parameter's size: not for what is of instruments and points, nor for a compliance."""
    return not name.startswith(_OF_INSTRUMENTS) and ".gravity_compliance" not in name
