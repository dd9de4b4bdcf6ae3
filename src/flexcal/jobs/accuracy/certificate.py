"""Accuracy of a robot at the same targets before and after compensation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from flexcal import __version__
from flexcal.calibration.accuracy import PoseRepeatability, visit_statistics
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import StratifiedSample
from flexcal.calibration.measurement import require_points
from flexcal.calibration.verification import (
    ErrorCovariance,
    ErrorScale,
    PredictionErrors,
    best_placement,
    can_register,
    can_register_with_points,
    error_scale,
    prediction_errors_with_covariance,
    rigid_placement,
    uncalibrated_model,
)
from flexcal.compensation import desired_pose
from flexcal.data.poses import PoseSet, ToolTargets, read_targets
from flexcal.errors import InputError
from flexcal.files.formats import sha256_of
from flexcal.files.transaction import real_path
from flexcal.jobs.accuracy.verification import require_stations, verification_poses
from flexcal.jobs.calibration import fitted_files, fitted_points
from flexcal.jobs.inputs import (
    CalibratedRobot,
    beyond_calibration,
    beyond_remark,
    outdated_remarks,
    unmeasured_targets_remark,
    with_temperature,
)
from flexcal.jobs.pages import Result
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import carried_mass, points_kinematics
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, check_improvement, prediction_checks
from flexcal.report.pages import CertificateStudy, write_certificate
from flexcal.report.results import NOT_GIVEN, MeasurementDetails
from flexcal.units import MILLIMETRE

_FAR = 0.25
"""Distance, rad or m, above which a measured pose does not belong to the joint positions of a target."""


@dataclass(frozen=True, eq=False)
class MeasuredTargets:
    """Measured `poses`, their `errors` (N, 3) m from their targets, and `centres` (P, 3) m, errors of the barycentres of the targets
    `numbers` (P,).

    `visits` is None where no target was visited twice.
    """

    poses: PoseSet
    errors: np.ndarray
    numbers: np.ndarray
    centres: np.ndarray
    visits: list[PoseRepeatability] | None

    @property
    def accuracy(self) -> ErrorStatistics:
        """Pose accuracy AP over all targets."""
        return ErrorStatistics.of(self.centres)

    def block(self) -> dict[str, Any]:
        """Block of the JSON document."""
        repeated = None
        if self.visits is not None:
            rp = np.array([pose.repeatability for pose in self.visits]) / MILLIMETRE
            repeated = {
                "visits": min(len(p.rows) for p in self.visits),
                "mean_mm": rp.mean(),
                "max_mm": rp.max(),
            }
        return {"measurements": len(self.poses), "ap": self.accuracy.in_millimetres(), "rp": repeated}


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(Result):
    """Result of `certify`: pose accuracy at the same targets before and after compensation.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    before : MeasuredTargets
        Before: the robot's own errors, with instrument and measured point registered by best fit; `accuracy` is AP.
    after : MeasuredTargets
        After, in the frame of the calibration.
    declared : MeasuredTargets or None
        Before, with instrument and point as robot.yaml declares them; None where it does not say enough.
    registered : MeasuredTargets
        Before, with the instrument alone registered by best fit.
    refitted : MeasuredTargets
        After, with instrument and point registered by best fit, as `before`.
    unmatched_targets : int
        Number of targets that were measured only before or only after.
    verification : PredictionErrors
        Errors of the calibrated robot at the points measured after.
    scale : ErrorScale
        Ratio of these to what the calibration predicts.
    sample : StratifiedSample or None
        Which of very many points these two are of.
    uncalibrated : tuple of str
        Remarks on points that the calibration did not measure, and on poses where it does not hold.
    fitted : tuple of str
        Files or points among those after that the calibration was made from.
    temperatures : tuple of str
        Remarks on the temperatures of the points measured after.
    files : mapping of str
        SHA-256 of the files by what they are, where the result was made from files.
    command : str
        Command line, where there was one.
    """

    before: MeasuredTargets
    after: MeasuredTargets
    declared: MeasuredTargets | None
    registered: MeasuredTargets
    refitted: MeasuredTargets
    unmatched_targets: int
    verification: PredictionErrors
    scale: ErrorScale
    sample: StratifiedSample | None
    uncalibrated: tuple[str, ...]
    fitted: tuple[str, ...]
    temperatures: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    command: str = ""

    @property
    def headline(self) -> str:
        """Pose accuracy AP before and after."""
        return f"AP at {len(self.after.numbers)} targets: before {self.before.accuracy}; after {self.after.accuracy}"

    def summary(self) -> str:
        """Pose accuracy before and after, remarks and verdict."""
        return "\n".join([self.headline, *self.remarks, self.trust.sentence])

    def report(
        self,
        path: str | Path,
        *,
        robot_serial: str = "",
        instrument: str = "",
        instrument_serial: str = "",
        operator: str = "",
        date: str = "",
    ) -> Path:
        """Write the certificate as one HTML page, two sheets of A4.

        Parameters
        ----------
        path : str or Path
            File to write.
        robot_serial, instrument, instrument_serial, operator, date : str
            Particulars of the measurement; each that is empty is a line to fill in by hand.

        Returns
        -------
        Path
            The file.
        """
        path = Path(path)
        details = MeasurementDetails(robot_serial, instrument, instrument_serial, operator, date)
        write_certificate(
            path, CertificateStudy(self.document(), self.before.centres, self.after.centres, details)
        )
        return path

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square distances after compensation, m: measured, and the known contributions."""
        parts = {
            "measured": float(np.sqrt((self.after.errors**2).sum(axis=1).mean())),
            "parameters": float(np.sqrt((self.verification.parameter_rms**2).mean())),
        }
        if self.after.poses.sigma_given:
            parts["instrument"] = float(np.sqrt((self.after.poses.sigma**2).sum(axis=1).mean()))
        if self.after.visits is not None:
            parts["visit_to_visit"] = _visit_to_visit(self.after.visits)
        return parts

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence each."""
        remarks = [
            *dict.fromkeys([*self.before.poses.notes, *self.after.poses.notes]),
            *self.uncalibrated,
            *self.temperatures,
        ]
        if self.unmatched_targets:
            remarks.append(
                f"targets that were measured only before or only after are not compared: {self.unmatched_targets}"
            )
        if self.sample is not None:
            remarks.append(
                f"accuracy is that of all {self.sample.total} points; the prediction is compared at {len(self.sample.rows)} of them, drawn "
                "evenly over positions and stations"
            )
        if self.fitted:
            remarks.append(
                f"the calibration was fitted to {' and '.join(self.fitted)}, so other targets may be less accurate"
            )
        if not self.scale.noise_known:
            remarks.append(
                "the files state no sigma, so the instrument's noise is counted as an error of the robot; 'flexcal import "
                "--sigma' states it"
            )
        return tuple(remarks)

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as those of a map, and whether the compensation made the robot more accurate."""
        before, after = (float(one.accuracy.mean) for one in (self.before, self.refitted))
        return Trust((check_improvement(before, after), *prediction_checks(self.scale, self.fitted)))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        temperature = [
            s.poses.temperature for s in (self.before, self.after) if s.poses.temperature is not None
        ]
        every = np.concatenate(temperature) if temperature else None
        poses = self.after.poses
        return {
            "robot": self.model.name,
            "date": date.today().isoformat(),
            "program": f"flexcal {__version__}",
            "targets": len(self.after.numbers),
            "points": list(poses.targets),
            "stations": list(poses.stations),
            "sigma_mm": float(np.median(poses.sigma)) / MILLIMETRE if poses.sigma_given else None,
            "payload_kg": sorted(
                {float(m) for m in carried_mass(self.model, poses.payload, len(poses)).round(3)}
            ),
            "temperature": None if every is None else [float(every.min()), float(every.max())],
            "before": self.before.block()
            | {
                "declared": None if self.declared is None else self.declared.accuracy.in_millimetres(),
                "registered": self.registered.accuracy.in_millimetres(),
                "own": self.before.accuracy.in_millimetres(),
            },
            "after": self.after.block(),
            "after_refitted": self.refitted.block(),
            "prediction": self.scale.document(),
            "rms_mm": {name: value / MILLIMETRE for name, value in self.rms.items()},
            "files": self.files,
            "verdict": self.trust.document(),
            "remarks": list(self.remarks),
            "command": self.command,
        }


def certify(
    robot: CalibratedRobot,
    targets: ToolTargets,
    before: PoseSet,
    after: PoseSet,
    *,
    temperature: float | None = None,
    progress: Progress = silent,
) -> Certificate:
    """Compare measurements at nominal and at compensated commands with the targets of both.

    Rows of `before` and `after` belong to the target of the same `pose` number. Before, instrument and measured point are registered
    by best fit; after, they are where the calibration has them.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    targets : ToolTargets
        Targets that were given to `compensate`.
    before : PoseSet
        Points measured with the nominal commands.
    after : PoseSet
        Points measured with the compensated commands, outside the fit.
    temperature : float, optional
        Temperature of the arm at both, °C, where the points do not say it.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Certificate
        Its `before` and `after`, `summary()`, and `report(path)`, the certificate.

    Raises
    ------
    FlexcalError
        Where fewer than four targets were measured before and after, a pose has no target, and where a station was not calibrated.

    Examples
    --------
    Poses of a real UR5 at nominal commands, here before and after, as if nothing was compensated:

    >>> from flexcal import RobotModel, ToolTargets, calibrate, certify, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> measured = read_poses("examples/ur5_tracker/random.csv", model)
    >>> targets = ToolTargets(measured.pose, measured.target, q=measured.q)
    >>> certificate = certify(robot, targets, before=measured, after=measured)
    >>> len(certificate.before.numbers), certificate.trust.status
    (20, 'bad')
    """
    for poses in (before, after):
        require_points(poses)
        require_stations(robot, poses)
    sets = {"before": before, "after": after}
    return _compared(robot, targets, "the targets", sets, temperature, progress)


def certify_robot(
    robot_file: Path,
    targets: Path,
    before: Path,
    after: Path,
    out: Path,
    *,
    estimates: Path | None = None,
    temperature: float | None = None,
    particulars: MeasurementDetails = NOT_GIVEN,
    command: str = "",
    progress: Progress = silent,
) -> Certificate:
    """`certify` of the robot of a robot.yaml by files of targets and of measured poses; the certificate is written to `out`.

    Raises `FlexcalError` where there is no calibration, files do not fit, and as `certify` does.
    """
    if out.suffix != ".html":
        raise InputError("E-RUN-001", f"{out} must end in .html; give another --out.")
    if real_path(before) == real_path(after):
        raise InputError(
            "E-RUN-002",
            f"{before} is given as --before and as --after; measure the compensated commands too.",
        )
    calibrated = CalibratedRobot.from_yaml(robot_file, estimates)
    assert calibrated.stored is not None
    progress("reading", 0.0)
    desired = read_targets(targets, calibrated.probable)
    sets = {str(file): verification_poses(calibrated, [file]) for file in (before, after)}
    progress("reading", 1.0)
    compared = _compared(calibrated, desired, str(targets), sets, temperature, progress)
    files = _files(
        [robot_file, calibrated.nominal.urdf],
        {"estimates": calibrated.stored, "targets": targets, "before": before, "after": after},
    )
    fitted = fitted_files(calibrated, [after]) or compared.fitted
    result = replace(compared, files=files, fitted=fitted, command=command)
    result.report(out, **asdict(particulars))
    return result


def _compared(
    robot: CalibratedRobot,
    desired: ToolTargets,
    origin: str,
    sets: dict[str, PoseSet],
    temperature: float | None,
    progress: Progress,
) -> Certificate:
    """The targets, called `origin`, with the two `sets` of measured poses by their names: before, then after; `sets` is emptied."""
    model, (first, last) = robot.probable, sets
    warm: tuple[str, ...] = ()
    for file, poses in sets.items():
        sets[file], warm = with_temperature(robot, poses, temperature)
    progress("comparing", 0.0)
    base, as_declared = (
        desired_pose(model, nominal, desired).position for nominal in (robot.with_points, robot.nominal)
    )
    rows = {file: _rows(file, poses, origin, desired) for file, poses in sets.items()}
    if desired.q is not None:
        off = [
            float(np.median(np.abs(poses.q - desired.q[rows[file]]).max(axis=1)))
            for file, poses in sets.items()
        ]
        if off[0] > off[1]:
            raise InputError(
                "E-RUN-003",
                f"{first} was measured farther from the nominal commands in {origin} than {last}; "
                "are --before and --after swapped?",
            )
    common = np.intersect1d(desired.pose[rows[first]], desired.pose[rows[last]])
    every = np.union1d(desired.pose[rows[first]], desired.pose[rows[last]])
    visited = {}
    for file in (first, last):
        poses = sets.pop(file)
        kept = np.isin(desired.pose[rows[file]], common)
        points = base[rows[file][kept]]
        visited[file] = (poses if kept.all() else poses.subset(kept), points)
        del poses
    if not all(can_register(poses) for poses, _ in visited.values()):
        raise InputError(
            "E-RUN-004",
            f"{len(common)} targets were measured before and after; four or more that do not lie on a line are needed.",
        )
    (start, start_points), (end, end_points) = visited[first], visited[last]
    sample = StratifiedSample.of(end)
    judged = slice(None) if sample is None else sample.rows
    known, covariance = prediction_errors_with_covariance(model, end.subset(judged))
    there = _visited(end, _placed(model, end, end_points))
    declared = as_declared[rows[first][np.isin(desired.pose[rows[first]], common)]]
    placed = uncalibrated_model(robot.nominal, start).declared
    progress("comparing", 1.0)
    return Certificate(
        model=robot.model,
        before=_visited(start, _best_fit(robot.with_points, start, start_points)),
        after=there,
        declared=None if placed is None else _visited(start, _placed(placed, start, declared)),
        registered=_visited(start, _registered(start, declared)),
        refitted=_visited(end, _best_fit(robot.with_points, end, end_points)),
        unmatched_targets=len(every) - len(common),
        verification=known,
        scale=error_scale(known, _measured_noise(there, covariance)),
        sample=sample,
        uncalibrated=(
            *outdated_remarks(robot),
            *unmeasured_targets_remark(robot, end.targets),
            *beyond_remark(
                robot, beyond_calibration(robot, end.q[judged], end.target[judged]), "measured points"
            ),
        ),
        temperatures=warm,
        fitted=fitted_points(robot, end),
    )


def _rows(file: str, poses: PoseSet, targets: str, desired: ToolTargets) -> np.ndarray:
    """The row of the targets (N,) that every measured row belongs to."""
    order = np.argsort(desired.pose)
    place = np.searchsorted(desired.pose, poses.pose, sorter=order).clip(max=len(order) - 1)
    rows = order[place]
    strange = np.flatnonzero(desired.pose[rows] != poses.pose)
    if len(strange):
        raise InputError(
            "E-RUN-005",
            f"{file}: pose {poses.pose[strange[0]]} is no target of {targets}; keep the targets' numbers when measuring.",
        )
    other = np.flatnonzero(desired.target[rows] != poses.target)
    if len(other):
        k = other[0]
        raise InputError(
            "E-RUN-006",
            f"{file}: pose {poses.pose[k]} was measured at '{poses.target[k]}', but its target is one of '{desired.target[rows[k]]}'.",
        )
    if desired.q is not None:
        apart = np.abs(poses.q - desired.q[rows])
        if apart.max() > _FAR:
            k, joint = (int(i) for i in np.argwhere(apart > _FAR)[0])
            raise InputError(
                "E-RUN-007",
                f"{file}: pose {poses.pose[k]} was measured {apart[k, joint]:.3g} from its target's q{joint + 1} in {targets}, so it is "
                "another one; keep the targets' numbers when measuring.",
            )
    return rows


def _placed(model: RobotModel, poses: PoseSet, points: np.ndarray) -> np.ndarray:
    """Targets (N, 3), given as `points` (N, 3) in the base frame, where `model` has the instrument's stations; m."""
    placed = np.empty_like(points)
    for name in poses.stations:
        own, place = poses.station == name, model.standing_station(name)
        placed[own] = points[own] @ vector_rotation(place[3:]).T + place[:3]
    return placed


def _registered(poses: PoseSet, points: np.ndarray) -> np.ndarray:
    """Targets (N, 3), given as `points` (N, 3) in the base frame, registered with the measured points by best fit; m."""
    return rigid_placement(poses, points).expected(poses, points, np.tile(np.eye(3), (len(poses), 1, 1)))


def _best_fit(nominal: RobotModel, poses: PoseSet, points: np.ndarray) -> np.ndarray:
    """As `_registered`, with the measured point on the tool fitted as well if the number of poses allows."""
    if not can_register_with_points(poses):
        return _registered(poses, points)
    turn = points_kinematics(nominal, poses.q, None, poses.target, jacobians=False).orientation
    return best_placement(poses, points, turn).expected(poses, points, turn)


def _visited(poses: PoseSet, targets: np.ndarray) -> MeasuredTargets:
    errors = poses.position - targets
    numbers, own, counts = np.unique(poses.pose, return_inverse=True, return_counts=True)
    centres = np.array([np.bincount(own, coordinate) for coordinate in errors.T]).T / counts[:, None]
    visits = visit_statistics(poses) if len(numbers) < len(poses) else None
    return MeasuredTargets(poses, errors, numbers, centres, visits)


def _measured_noise(visited: MeasuredTargets, covariance: ErrorCovariance) -> ErrorCovariance:
    """Covariance with the observed scatter of visits in place of the predicted one, if there were several visits."""
    if visited.visits is None:
        return covariance
    variance = _visit_to_visit(visited.visits) ** 2 / 3
    return replace(covariance, independent=np.tile(variance * np.eye(3), (len(covariance.roots), 1, 1)))


def _visit_to_visit(visits: list[PoseRepeatability]) -> float:
    """Root mean square distance of single visits from their expected barycentre, m."""
    deviations = np.concatenate([pose.deviations for pose in visits])
    return float(np.sqrt((deviations**2).sum() / (len(deviations) - len(visits))))


def _files(robot: list[Path], others: Mapping[str, Path]) -> dict[str, str]:
    """Role, name and SHA-256 of each file."""
    named = {"robot": robot[0], "URDF": robot[1]} | dict(others)
    return {f"{label}: {path.name}": sha256_of(path) for label, path in named.items()}
