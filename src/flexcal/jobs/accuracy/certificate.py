"""Accuracy of a robot at the same targets before and after compensation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import PoseRepeatability, repeatability
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import StratifiedSample
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
from flexcal.jobs.accuracy.verification import verification_poses
from flexcal.jobs.calibration import fitted_files, fitted_points
from flexcal.jobs.inputs import CalibratedRobot, unmeasured_targets_remark
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import carried_mass, points_kinematics
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, prediction_checks
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


@dataclass(frozen=True, eq=False)
class RobotCertificate:
    """Errors before and after at the same targets; `refitted`: after, with instrument and point registered by best fit, as before.

    `before` are the robot's own errors, `declared` and `registered` the others of `UncalibratedRobot`. `verification` and `scale`: the
    measurements after against what the calibration predicts, of a `sample` where there are very many. `command`: the command line.
    """

    robot: CalibratedRobot
    declared: MeasuredTargets | None
    registered: MeasuredTargets
    before: MeasuredTargets
    after: MeasuredTargets
    refitted: MeasuredTargets
    unmatched_targets: int
    verification: PredictionErrors
    scale: ErrorScale
    sample: StratifiedSample | None
    files: Mapping[str, str]
    fitted: tuple[str, ...]
    command: str = ""

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
        """Remarks, one sentence each."""
        remarks = list(unmeasured_targets_remark(self.robot, self.after.poses.targets))
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
        """The verdict, from the same checks as those of a map."""
        return Trust(prediction_checks(self.scale, self.fitted))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        temperature = [
            s.poses.temperature for s in (self.before, self.after) if s.poses.temperature is not None
        ]
        every = np.concatenate(temperature) if temperature else None
        model = self.robot.model
        poses = self.after.poses
        return {
            "robot": model.name,
            "date": date.today().isoformat(),
            "program": f"flexcal {version('flexcal')}",
            "targets": len(self.after.numbers),
            "points": list(poses.targets),
            "stations": list(poses.stations),
            "sigma_mm": float(np.median(poses.sigma)) / MILLIMETRE if poses.sigma_given else None,
            "payload_kg": sorted({float(m) for m in carried_mass(model, poses.payload, len(poses)).round(3)}),
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


def certify_robot(
    robot_file: Path,
    targets: Path,
    before: Path,
    after: Path,
    out: Path,
    *,
    estimates: Path | None = None,
    particulars: MeasurementDetails = NOT_GIVEN,
    command: str = "",
    progress: Progress = silent,
) -> RobotCertificate:
    """Compare measurements at nominal and at compensated commands with the targets of both, and write the certificate to `out`.

    Rows of `before` and `after` belong to the target of the same `pose` number. Before, instrument and measured point are registered
    by best fit; after, they are where the calibration has them. Raises `FlexcalError` where there is no calibration, files do
    not fit, or fewer than four targets were measured before and after.
    """
    if out.suffix != ".html":
        raise InputError("E-RUN-001", f"{out} must end in .html; give another --out.")
    if before.resolve() == after.resolve():
        raise InputError(
            "E-RUN-002",
            f"{before} is given as --before and as --after; measure the compensated commands too.",
        )
    calibrated = CalibratedRobot.from_yaml(robot_file, estimates)
    assert calibrated.stored is not None
    model = calibrated.probable
    progress("reading", 0.0)
    desired = read_targets(targets, model)
    base, as_declared = (
        desired_pose(model, nominal, desired).position
        for nominal in (calibrated.with_points, calibrated.nominal)
    )
    sets = {file: verification_poses(calibrated, [file]) for file in (before, after)}
    rows = {file: _rows(file, poses, targets, desired) for file, poses in sets.items()}
    progress("reading", 1.0)
    progress("comparing", 0.0)
    if desired.q is not None:
        off = {file: np.abs(poses.q - desired.q[rows[file]]).max(axis=1) for file, poses in sets.items()}
        if np.median(off[before]) > np.median(off[after]):
            raise InputError(
                "E-RUN-003",
                f"{before} was measured farther from the nominal commands in {targets} than {after}; are --before and --after swapped?",
            )
    common = np.intersect1d(desired.pose[rows[before]], desired.pose[rows[after]])
    every = np.union1d(desired.pose[rows[before]], desired.pose[rows[after]])
    visited = {}
    for file in (before, after):
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
    sample = StratifiedSample.of(visited[after][0])
    judged = slice(None) if sample is None else sample.rows
    known, covariance = prediction_errors_with_covariance(model, visited[after][0].subset(judged))
    there = _visited(visited[after][0], _placed(model, *visited[after]))
    start = visited[before][0]
    declared = as_declared[rows[before][np.isin(desired.pose[rows[before]], common)]]
    placed = uncalibrated_model(calibrated.nominal, start).declared
    result = RobotCertificate(
        calibrated,
        None if placed is None else _visited(start, _placed(placed, start, declared)),
        _visited(start, _registered(start, declared)),
        _visited(start, _best_fit(calibrated.with_points, *visited[before])),
        there,
        _visited(visited[after][0], _best_fit(calibrated.with_points, *visited[after])),
        len(every) - len(common),
        known,
        error_scale(known, _measured_noise(there, covariance)),
        sample,
        _files(
            [robot_file, calibrated.nominal.urdf],
            {"estimates": calibrated.stored, "targets": targets, "before": before, "after": after},
        ),
        fitted_files(calibrated, [after]) or fitted_points(calibrated, visited[after][0]),
        command,
    )
    progress("comparing", 1.0)
    write_certificate(
        out, CertificateStudy(result.document(), result.before.centres, result.after.centres, particulars)
    )
    return result


def _rows(file: Path, poses: PoseSet, targets: Path, desired: ToolTargets) -> np.ndarray:
    """Index of the target, out of `targets` (N,), of every measured row."""
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
        own, place = poses.station == name, model.stations.pose[model.station_index(name)]
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
    visits = repeatability(poses) if len(numbers) < len(poses) else None
    return MeasuredTargets(poses, errors, numbers, centres, visits)


def _measured_noise(visited: MeasuredTargets, covariance: ErrorCovariance) -> ErrorCovariance:
    """Covariance with the observed scatter of visits in place of the predicted one, if there were several visits."""
    if visited.visits is None:
        return covariance
    variance = _visit_to_visit(visited.visits) ** 2 / 3
    return replace(covariance, independent=np.tile(variance * np.eye(3), (len(covariance.roots), 1, 1)))


def _visit_to_visit(visits: list[PoseRepeatability]) -> float:
    """Root mean square distance of single visits from their expected barycentre, m."""
    spread = np.concatenate([pose.deviations for pose in visits])
    return float(np.sqrt((spread**2).sum() / (len(spread) - len(visits))))


def _files(robot: list[Path], others: Mapping[str, Path]) -> dict[str, str]:
    """Role, name and SHA-256 of each file."""
    named = {"robot": robot[0], "URDF": robot[1]} | dict(others)
    return {f"{label}: {path.name}": sha256_of(path) for label, path in named.items()}
