"""Remarks on a calibration: assumptions, outliers, drift, noise, and signs of faulty data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.diagnostics import (
    Drift,
    NearestSocket,
    ReadingLag,
    RepeatabilityFloor,
    RobotSize,
    SensorLag,
    StatedNoise,
    deviations_from_prior,
    displacements,
    far_zeros,
    implausible_shifts,
    is_implausible,
    nearest_sockets,
    reading_jumps,
    residuals_implausible,
    stated_noise,
)
from flexcal.calibration.fit import GeometricFit, error_kind
from flexcal.data.poses import PoseSet
from flexcal.estimation import Estimate
from flexcal.jobs.calibration.few_readings import few_readings_remarks
from flexcal.jobs.calibration.ignored_columns import ignored_columns_remarks
from flexcal.jobs.calibration.inclinations import inclination_remarks
from flexcal.jobs.calibration.thermal import thermal_remarks
from flexcal.model.robot import BOARD_SCALE, LATERAL, socket_scale
from flexcal.report.checks import INVISIBLE
from flexcal.report.layout import counted, listed
from flexcal.report.results import chance_in_words
from flexcal.units import FELT, MILLIMETRE, decimals

_LOOK = (
    "data and robot.yaml do not go together: look for a column with wrong sign, unit or order, for a wrong xyz under `points:`, for "
    "points of another target or robot, and for points seen by an instrument on the hand (eye-in-hand, not supported); "
    "flexcal import looks for these"
)

_OVERSTATED, _UNDERSTATED = 0.5, 2.0
"""Ratio of estimated noise to the stated sigma, below and above which a remark is made."""

_CERTAINLY = 3.0
"""Standard deviations below zero from which a compliance is negative."""
_FLOOR = 2.0
"""Scatter from pose to pose, relative to all other errors together, from which it is what limits the accuracy."""
_GAIN = 1 / 3
"""Share of the errors before that is left by a calibration which gained little."""

_LENGTHS = {
    BOARD_SCALE: "by the other readings, the declared size of the board is wrong",
}
"""What is said where readings of another kind show the scale of lengths."""

_PER_MILLE = 1e-3

_ANOTHER_CONVENTION = np.deg2rad(5)
"""Deviation of an orientation, rad, above which it is none of the convention of the others."""

_SHOWN = 3
_LISTED = 20
_KINDS = {
    "offset": ("joint zeros", 1e3, "mrad"),
    "rad": ("other angles", 1e3, "mrad"),
    "m": ("lengths", 1 / MILLIMETRE, "mm"),
    "compliance": ("compliances", 1e6, "µrad/(N m)"),
}
"""Errors of joints that share a tolerance: name, and factor and unit in which it is given."""


@dataclass(frozen=True)
class Outlier:
    """Measurement with a small weight in the robust loss: number of its pose, point, distance from the fit (m), angle from it (rad) where
    the orientation was measured.

    Of a ball in a socket also `place` and `socket`, and the `nearest` of all sockets to the ball.
    """

    pose: int
    target: str
    error: float
    angle: float | None = None
    place: str = ""
    socket: str = ""
    nearest: NearestSocket | None = None

    @property
    def is_mislabelled(self) -> bool:
        """Whether the ball was nearer to another socket than to that of its row."""
        own = self.place, self.socket
        return self.nearest is not None and (self.nearest.place, self.nearest.socket) != own

    def __str__(self) -> str:
        if self.angle is not None and self.error == 0:
            return f"pose {self.pose} ({self.target}, {np.rad2deg(self.angle):.2f}°)"
        turned = "" if self.angle is None else f", {np.rad2deg(self.angle):.2f}°"
        where = f", {self.place} {self.socket}" if self.socket else ""
        return f"pose {self.pose} ({self.error / MILLIMETRE:.2f} mm{turned}{where})"

    def document(self) -> dict[str, object]:
        """Entry of results.json."""
        turned = {} if self.angle is None else {"angle_deg": float(np.rad2deg(self.angle))}
        held = (
            {}
            if self.nearest is None
            else {"place": self.place, "socket": self.socket, "nearest": self.nearest.document()}
        )
        return {
            "pose": self.pose,
            "target": self.target,
            "error_mm": self.error / MILLIMETRE,
            **turned,
            **held,
        }


def outliers_of(fit: GeometricFit) -> tuple[Outlier, ...]:
    """Outliers of a fit, the farthest first."""
    distance, poses = np.linalg.norm(fit.residuals, axis=1), fit.poses
    rows = sorted(fit.estimate.outliers, key=lambda row: -distance[row])
    held = [row for row in rows if poses.in_socket[row]]
    nearest = dict(zip(held, nearest_sockets(fit, held), strict=True)) if held else {}
    turned = np.flatnonzero(poses.turned).tolist()
    angle = dict(zip(turned, np.linalg.norm(fit.rotations, axis=1).tolist(), strict=True))
    angle |= dict(
        zip(
            np.flatnonzero(poses.tilted).tolist(),
            np.nanmax(np.abs(fit.tilts), axis=1, initial=0.0).tolist(),
            strict=True,
        )
    )
    return tuple(
        Outlier(
            int(poses.pose[row]),
            str(poses.target[row]),
            float(distance[row]),
            angle.get(row),
            str(poses.station[row]) if row in nearest else "",
            str(poses.socket[row]) if row in nearest and poses.socket is not None else "",
            nearest.get(row),
        )
        for row in rows
    )


def outlying_stations(poses: PoseSet, outliers: Sequence[int]) -> dict[str, str]:
    """Stations most of whose poses are `outliers` (rows) beside those of others, each with a sentence that says so."""
    out = np.isin(np.arange(len(poses)), outliers)
    found = {}
    for name in poses.stations if len(poses.stations) > 1 else ():
        own = poses.station == name
        if 2 * out[own].sum() > own.sum():
            found[name] = (
                f"{out[own].sum()} of the {own.sum()} poses of station '{name}' are outliers: they do not agree with the others, as where "
                "the target was mounted anew or the instrument moved between them; give these a target or a station of their own"
            )
    return found


def calibration_remarks(
    fit: GeometricFit,
    cause: Sequence[str] = (),
    *,
    prior_misfits: bool = False,
    sensor_lag: SensorLag | None = None,
) -> tuple[str, ...]:
    """Remarks on a calibration, the most important last; a known `cause` of a bad fit precedes its consequences, and
    `prior_misfits` says that a prior of other robots is one. `sensor_lag` is that of the temperature's sensor.
    """
    remarks = [
        *fit.poses.notes,
        *ignored_columns_remarks(fit.poses, () if fit.temperature is None else ("temperature", "time")),
        *thermal_remarks(fit, sensor_lag),
        *_without_readings(fit),
        *_nominal_springs(fit),
    ]
    if fit.ambiguous.any():
        remarks.append(f"the flank of a backlash is uncertain at {fit.ambiguous.sum()} poses")
    outliers = outliers_of(fit)
    if outliers:
        told = listed([str(outlier) for outlier in outliers], _LISTED)
        remarks.append(f"{counted(len(outliers), 'outlier')}: {told}")
        remarks += [*_mislabelled(outliers), *_turned(fit, outliers)]
        remarks += [*outlying_stations(fit.poses, fit.estimate.outliers).values()]
    remarks += [
        *_undetermined(fit),
        *_by_prior(fit),
        *_views(fit),
        *_size(fit),
        *_noise(fit, prior_misfits=prior_misfits),
        *few_readings_remarks(fit),
        *_jumps(fit),
        *negative_compliances(fit.estimate, lambda changes: displacements(fit, changes)),
    ]
    remarks += inclination_remarks(fit)
    drift = Drift.of(fit) if fit.poses.located.any() else None
    if drift is not None and drift.certain:
        remarks.append(
            f"residuals drift with time ({chance_in_words(drift.probability)}), by {drift.residual / MILLIMETRE:.3f} mm from first to last "
            f"pose, and the fit may have taken up more: a drift of {drift.distance / MILLIMETRE:.3f} mm beside it explains the readings "
            "best; robot or instrument warmed up, or position and measuring order are correlated"
        )
    remarks += _against_prior(fit)
    remarks += cause
    if not cause and not residuals_implausible(fit):
        remarks += _zeros(fit)
    far = implausible_shifts(fit)
    if far:
        named = [f"{m.name} ({m.start:.4g} to {m.value:.4g} {m.unit})" for m in far[:_SHOWN]]
        more = f" and {len(far) - _SHOWN} others" if len(far) > _SHOWN else ""
        remarks.append(f"implausibly far from the nominal value: {', '.join(named)}{more}")
    if is_implausible(fit) and not cause:
        remarks.append(_LOOK)
    if not fit.estimate.converged:
        remarks.append(
            f"the fit has not converged ({fit.estimate.status}), so its values and intervals mean nothing: check the columns with 'flexcal "
            "import' and the nominal geometry in the URDF, take fewer terms under `geometry:`, or measure more poses, farther apart"
        )
    return tuple(remarks)


def negative_compliances(
    estimate: Estimate, displacements: Callable[[Mapping[str, float]], np.ndarray]
) -> Sequence[str]:
    """Remark on compliances that are negative beyond three standard deviations, and move the points by more than robots repeat to.

    `displacements` are those (k,), m, by changes of parameters.
    """
    stds = {
        item.name: estimate.std(item.name)
        for item in estimate.parameters
        if item.name.rpartition(".")[2] in ("gravity_compliance", *LATERAL)
    }
    found = [name for name, std in stds.items() if std and estimate.values[name] < -_CERTAINLY * std]
    told = []
    for name, moved in zip(
        found, displacements({name: estimate.values[name] for name in found}), strict=True
    ):
        if moved > FELT:
            across = "" if name.endswith("gravity_compliance") else ", across its axis"
            unit = estimate.parameters[name].unit.replace("rad", "µrad")
            size = f"{1e6 * estimate.values[name]:.3g} {estimate.spread(name, 1e6)} {unit}"
            told.append(f"{name.rpartition('.')[0]} ({size}{across})".replace("-", "−"))
    if not told:
        return ()
    return (
        f"negative compliance under gravity: {listed(told, _LISTED)}; no joint yields against its load, so another error that changes with "
        "it is in this term: a wrong mass of a link or the payload, a balancer, or an error of transmission",
    )


def _zeros(fit: GeometricFit) -> Sequence[str]:
    """Remark on joint zeros that are far from those of the URDF."""
    zeros = far_zeros(fit)
    if not zeros:
        return ()
    return (
        f"joint zeros are far from those of the URDF: {', '.join(map(str, zeros))}; the calibrated robot takes them into account, and "
        "'flexcal export offsets' lists them for the controller; set them there, and smaller errors will show",
    )


def _against_prior(fit: GeometricFit) -> Sequence[str]:
    """Remark on springs and inertia that the points put far from what is known of them beforehand."""
    far = deviations_from_prior(fit)
    if not far:
        return ()
    named = [
        f"{s.name} ({s.start:.4g} to {s.value:.4g} {s.unit}, {s.times:.2g} standard deviations)" for s in far
    ]
    return (
        f"the points do not agree with what robot.yaml or stage 1 says of {listed(named, _LISTED)}: one of the two is wrong, or an error "
        "that changes with the load is in these parameters",
    )


def _mislabelled(outliers: Sequence[Outlier]) -> Sequence[str]:
    """Remark on rows whose ball was in another socket than they say."""
    confused = [
        f"pose {o.pose} ({o.place} {o.socket}; {o.nearest.distance / MILLIMETRE:.2f} mm from {o.nearest.place} {o.nearest.socket})"
        for o in outliers
        if o.is_mislabelled and o.nearest is not None
    ]
    if not confused:
        return ()
    return [
        f"nearer to another socket than to their own, so perhaps mislabelled: {listed(confused, _LISTED)}"
    ]


def _nominal_springs(fit: GeometricFit) -> Sequence[str]:
    """Springs that stage 1 did not identify have a declared prior of their own in place of its posterior, but those of other robots."""
    springs = [p for p in fit.prior.parameters if p.name.endswith(".stiffness")]
    pooled = fit.model.prior.parameters
    nominal = [
        p.name.removesuffix(".stiffness")
        for p in springs
        if np.isfinite(p.prior_std) and p.name not in pooled
    ]
    if not nominal:
        return ()
    which = "" if len(nominal) == len(springs) else f" of {', '.join(nominal)}"
    return (
        f"the stiffness{which} was not identified: the nominal one of robot.yaml is used with a standard deviation of "
        f"{fit.model.prior.stiffness:.0%}; run 'flexcal identify stiffness' first to identify it",
    )


def _undetermined(fit: GeometricFit) -> Sequence[str]:
    """Remarks on parameters that the poses do not determine, one sentence per cause."""
    causes: dict[str, list[str]] = {}
    for item in fit.undetermined:
        causes.setdefault(item.cause, []).append(item.name)
    return [
        f"not determined by these poses, held at the nominal value: {', '.join(names)} ({cause})"
        for cause, names in causes.items()
    ]


def _by_prior(fit: GeometricFit) -> Sequence[str]:
    """Remarks on errors that the poses leave to the tolerances of manufacture, and on the size of these."""
    sizes: dict[str, list[float]] = {}
    for item in fit.estimate.parameters:
        kind = error_kind(fit.model, item.name)
        if kind and np.isfinite(item.prior_std) and item.name in fit.model.prior.parameters:
            sizes.setdefault(kind, []).append(item.prior_std)
    if not sizes or not fit.by_prior:
        return ()
    told = [
        f"{_KINDS[kind][0]} {np.median(own) * _KINDS[kind][1]:.2g} {_KINDS[kind][2]}"
        for kind, own in sizes.items()
    ]
    causes: dict[str, list[str]] = {}
    for item in fit.by_prior:
        causes.setdefault(item.cause, []).append(item.name)
    return [
        f"the poses do not determine all errors of the joints, which have tolerances as prior (1σ, as likely as the points make them: "
        f"{listed(told, len(told))}); what is left open is in every interval and predicted error",
        *(
            f"told less by these poses than by their prior: {listed(names, _LISTED)}{f' ({cause})' if cause else ''}"
            for cause, names in causes.items()
        ),
    ]


def _views(fit: GeometricFit) -> Sequence[str]:
    """Remark on what errors in millimetres are where a camera measured."""
    seen = fit.poses.seen
    if not seen.any():
        return ()
    noise, found = (
        float(np.sqrt(np.mean(np.sum(rows[seen] ** 2, axis=1)))) / MILLIMETRE
        for rows in (fit.poses.sigma, fit.residuals)
    )
    return (
        f"{seen.sum()} poses were measured by a camera, each with the noise of its own view: {noise:.3f} mm rms expected, {found:.3f} mm "
        "found; the fit weighs the views by their noise",
    )


def _size(fit: GeometricFit) -> Sequence[str]:
    """Remark on what tells the size of the robot where an instrument of points does not."""
    if fit.size:
        name = fit.size[0]
        std = fit.estimate.parameters[name].prior_std
        return (
            f"none of these readings tells how large the robot is: it has its size from {name} at the nominal value, taken as known to "
            f"{std / MILLIMETRE:.2g} mm, and all its lengths are off in the same ratio as that; measure with a wire, sockets at a known "
            "distance or an instrument of points too where that matters",
        )
    size = RobotSize.of(fit)
    if size is not None:
        return (size.sentence,)
    estimate = fit.estimate
    wires = {f"station.{name}.scale": name for name in fit.poses.stations}
    sockets = {
        socket_scale(name): "by the other readings, the declared distances of the sockets"
        + (f" of {name}" if len(fit.poses.holders) > 1 else "")
        + " are wrong"
        for name in fit.poses.holders
    }
    what = (
        sockets
        | _LENGTHS
        | {scale: f"by the other readings, the lengths of {name} are wrong" for scale, name in wires.items()}
    )
    return [
        f"{what[name]} by {abs(interval[0] + interval[1]) / 2 / _PER_MILLE:.2g} ± {(interval[1] - interval[0]) / 2 / _PER_MILLE:.1g} per "
        "mille (95 %), which the fit takes into account"
        for name in what
        if name in estimate.parameters
        and (interval := estimate.interval(name))
        and interval[0] * interval[1] > 0
    ]


def _jumps(fit: GeometricFit) -> Sequence[str]:
    """Remark on instruments that were zeroed or moved between two measurements."""
    jumps = reading_jumps(fit)
    if not jumps:
        return ()
    listed = ", ".join(
        f"{jump.station} by {jump.size / MILLIMETRE:+.2f} mm between poses {jump.before} and {jump.after}"
        for jump in jumps[:_SHOWN]
    )
    more = (
        f" and {len(jumps) - _SHOWN} smaller ones, which may follow from these" if len(jumps) > _SHOWN else ""
    )
    return (
        f"the readings jump: {listed}{more}. What is zeroed, hung up again or moved between measurements is another instrument: declare "
        "one for each part under `measurements:` in robot.yaml, and name it in the column `wire` or `touched`",
    )


def _without_readings(fit: GeometricFit) -> Sequence[str]:
    """Remark on declared instruments of which there are no readings."""
    poses = fit.poses
    read = {*poses.station.tolist(), *([] if poses.camera is None else poses.camera.tolist())}
    read |= {*poses.target[poses.tilted].tolist(), *poses.holders}
    declared = fit.model.config.measurements
    missing = [name for name in declared if name not in read]
    if not missing:
        return ()
    return (f"robot.yaml declares {', '.join(missing)} under `measurements:`, of which no file has readings",)


def _turned(fit: GeometricFit, outliers: Sequence[Outlier]) -> Sequence[str]:
    """Remark on orientations of some rows that follow another convention than the others."""
    far = sum(outlier.angle is not None and outlier.angle > _ANOTHER_CONVENTION for outlier in outliers)
    if far < _SHOWN:
        return ()
    return (
        f"{far} of {len(fit.rotations)} orientations differ from the robot's by more than {np.rad2deg(_ANOTHER_CONVENTION):.0f}°, which no "
        "noise does: these rows may follow another convention than the others, as quaternions in another order or inverse ones",
    )


def _contradicted(test: StatedNoise) -> str:
    """What the residuals say against the stated noise of an instrument."""
    of = f" of {test.name}" if test.name else ""
    cause = (
        "it is too large"
        if test.factor < 1
        else "it is too small, or the robot does not repeat so well; weights and intervals include the difference"
    )
    return (
        f"the readings{of} scatter {test.factor:.2g} times as much as the stated sigma says (χ² is {test.chi2:.2f} per degree of freedom, "
        f"{chance_in_words(test.probability)}): {cause}"
    )


def lag_remark(lag: ReadingLag | None) -> tuple[str, ...]:
    """Remark on points that were read at another instant than the joint positions."""
    if lag is None or not lag.certain:
        return ()
    size = (
        f"by {abs(lag.lag) * 1e3:.3g} ± {1.96 * lag.std * 1e3:.2g} ms"
        if lag.timed
        else f"by {abs(lag.lag):.2g} ± {1.96 * lag.std:.1g} of the time from one row to the next"
    )
    return (
        f"the points {'lag behind' if lag.lag > 0 else 'are ahead of'} the joint positions {size} (95 %), which explains {lag.share:.0%} "
        f"of the squares of the residuals ({chance_in_words(lag.probability)}): the robot moved while they were read, and not at the same "
        "instant; let it stand still at every pose, or write both as they were at the same time, and measure again",
    )


def floor_remark(fit: GeometricFit, before: np.ndarray | None) -> tuple[str, ...]:
    """Remark where the scatter from pose to pose is what is left, and large; `before` (N, 3), m, are the errors without calibration."""
    rows = int(fit.poses.present.sum())
    if not rows or residuals_implausible(fit):
        return ()
    floor = RepeatabilityFloor.of(fit)
    own = () if floor is None else (floor.sentence,)
    budget = fit.variances
    robot, model, instrument = (
        float(budget[key] or 0.0) for key in ("robot_mm", "model_mm", "instrument_mm")
    )
    dof = fit.estimate.degrees_of_freedom
    parameters = robot * np.sqrt(max(rows - dof, 0) / rows)
    if (
        before is None
        or is_implausible(fit)
        or robot < _FLOOR * np.hypot(np.hypot(model, parameters), instrument)
    ):
        return own
    if fit.errors.mean < _GAIN * float(np.linalg.norm(before, axis=1).mean()):
        return own
    play = "" if floor is None else f", as of {floor.joint_degrees:.2g}° at every joint"
    return (
        f"the scatter from pose to pose, {robot:.2f} mm per coordinate (1σ){play}, is most of what is left: model errors of {model:.2f} mm "
        f"and parameters known to {parameters:.2f} mm at these poses add little to it. Visits to the same poses tell how much of it is the "
        "robot's repeatability (flexcal repeatability), which no calibration removes",
    )


def _noise(fit: GeometricFit, *, prior_misfits: bool) -> Sequence[str]:
    budget = fit.variances
    instrument, stated, robot, model = (
        budget[key] for key in ("instrument_mm", "stated_mm", "robot_mm", "model_mm")
    )
    if robot is None or model is None:
        return ()
    remarks = []
    scatter = f"{robot:.{decimals(robot)}f} mm per coordinate"
    if prior_misfits and instrument is not None and robot <= _UNDERSTATED * (stated or 0.0):
        return []
    if prior_misfits:
        return [
            f"the points scatter by {scatter} about the fit (1σ), because the prior of other robots holds it where this robot is not: that "
            "is no repeatability of the robot and no noise of the instrument"
        ]
    if instrument is None or stated is None:
        text = (
            f"the ball in its socket and the robot together scatter by {scatter} about the fit (1σ)"
            if fit.poses.in_socket.all()
            else f"no sigma in the files: scatter of instrument and robot together about the fit is {scatter} (1σ)"
        )
        remarks.append(f"{text}, which is too large for noise" if residuals_implausible(fit) else text)
    elif instrument < _OVERSTATED * stated:
        remarks.append(
            f"the stated sigma of {stated:.3g} mm is {stated / np.hypot(instrument, robot):.3g} times the scatter of the points; the "
            "estimated scatter is used"
        )
    elif robot > _UNDERSTATED * stated:
        remarks.append(
            f"in addition to the stated sigma of {stated:.3g} mm the points scatter by {scatter}: repeatability of the "
            "robot, or a sigma that is too small; weights and intervals include both"
        )
    else:
        tests = stated_noise(fit)
        remarks += [_contradicted(test) for test in tests[1:] or tests if test.contradicted]
    if model > INVISIBLE:
        remarks.append(
            f"systematic model errors of {model:.{decimals(robot)}f} mm per coordinate (1σ) remain; intervals include them"
        )
    return remarks
