"""Verification of a calibrated robot on positions outside the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.comparison import ALUMINIUM
from flexcal.calibration.diagnostics import ReadingLag
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import StratifiedSample, all_errors
from flexcal.calibration.kinds import about_sockets, socket_numbers
from flexcal.calibration.measurement import predicted_positions, require_points, seen_from_base
from flexcal.calibration.verification import (
    CALIBRATED,
    ErrorCovariance,
    MeasuredPoints,
    OrientationErrors,
    PredictionErrors,
    Refit,
    RefittedVerification,
    SocketDistance,
    UncalibratedErrors,
    arms_at,
    errors_before,
    orientation_document,
    orientation_errors,
    prediction_document,
    prediction_errors_with_covariance,
    repeated_contacts,
    require_contacts,
    uncalibrated_model,
    uncalibrated_orientations,
    verify_contacts,
    verify_refitted,
)
from flexcal.data.poses import PoseSet, read_poses, tables_of
from flexcal.errors import FlexcalError
from flexcal.files.formats import provenance
from flexcal.jobs.accuracy.registration_refit import proposed_refit, refit_document, refit_remarks
from flexcal.jobs.calibration import (
    fitted_files,
    fitted_points,
    ignored_columns_remarks,
    lag_remark,
    other_sides_remark,
    outside_ranges,
    subsample_document,
    verification_subsample_remark,
)
from flexcal.jobs.inputs import (
    CalibratedRobot,
    image_provenance,
    is_station_identified,
    kelvin_outside,
    outdated_remarks,
    require_distinct_files,
    with_temperature,
)
from flexcal.jobs.pages import ReportedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header, write_arm, write_points
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, verification_checks
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False, repr=False)
class Verification(ReportedResult):
    """Result of `verify`: errors of a calibrated robot at points outside the fit.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    poses : PoseSet
        The measured points.
    predicted : PredictionErrors
        Errors, with their predicted size; leave-one-out where something was fitted to these poses.
    covariance : ErrorCovariance
        Predicted covariance of the errors.
    before : UncalibratedErrors
        Errors of the uncalibrated robot.
    refit : RefittedVerification or None
        What was fitted to these poses.
    as_calibrated : PredictionErrors or None
        Errors without what was fitted.
    better : RefittedVerification or None
        What would explain most of the errors if it were fitted to these poses; None where nothing would.
    uncalibrated : tuple of str
        Points that the calibration did not measure and that were not fitted.
    outside : str
        Which poses lie outside the joint ranges of the calibration.
    fitted : tuple of str
        Files or points among these that the calibration was made from.
    refused : str
        Why the verdict on the calibration itself was no; empty where it was not.
    outdated : tuple of str
        Remarks on blocks of the estimates that were computed from another robot than now.
    record : RunRecord
        What the result comes from.
    orientation : OrientationErrors or None
        Errors of the measured orientations; None without any.
    orientation_before : OrientationErrors or None
        Errors of the orientations of the uncalibrated robot.
    sample : StratifiedSample or None
        Which of very many points were taken.
    everywhere : ErrorStatistics or None
        Errors at all points, where a sample was taken.
    temperatures : tuple of str
        Remarks on the temperatures of the points.
    outside_temperatures : float or None
        How far these lie outside the temperatures of a calibration without a term for them, K, at most, negative below them; None where
        either is not known.
    distances : tuple of SocketDistance
        Errors of the known distances between sockets, where a ball in these was measured; the errors are then deviations of the ball from
        its mean position in each socket, m, base frame.
    """

    poses: PoseSet
    predicted: PredictionErrors
    covariance: ErrorCovariance
    before: UncalibratedErrors
    refit: RefittedVerification | None
    as_calibrated: PredictionErrors | None
    better: RefittedVerification | None
    uncalibrated: tuple[str, ...]
    outside: str
    fitted: tuple[str, ...]
    refused: str = ""
    outdated: tuple[str, ...] = ()
    record: RunRecord = NOT_RECORDED
    orientation: OrientationErrors | None = None
    orientation_before: OrientationErrors | None = None
    sample: StratifiedSample | None = None
    everywhere: ErrorStatistics | None = None
    temperatures: tuple[str, ...] = ()
    outside_temperatures: float | None = None
    distances: tuple[SocketDistance, ...] = ()

    @property
    def residuals(self) -> np.ndarray:
        """Measured minus predicted positions (N, 3), m."""
        return self.predicted.errors

    @property
    def errors(self) -> ErrorStatistics:
        """Distances between predicted and measured points at all poses."""
        return self.everywhere or self.predicted.all

    @property
    def headline(self) -> str:
        """Errors in one line."""
        return str(self.errors)

    def summary(self) -> str:
        """Errors, their predicted size, remarks and verdict."""
        return "\n".join([self.predicted.summary(), *self.remarks, self.trust.sentence])

    def write_arrays(self, folder: Path) -> None:
        """Leave points.csv and arm.npz in a folder."""
        points = self.points
        write_points(folder, points)
        write_arm(folder, arms_at(self.model, self.poses, points.shown))

    @cached_property
    def lag(self) -> ReadingLag | None:
        """Whether points and joint positions were read at different instants while the robot moved; None where the rows cannot tell."""
        return ReadingLag.of_errors(self.model, self.poses, self.predicted.errors)

    @property
    def points(self) -> MeasuredPoints:
        """Points with the errors before and after."""
        errors = errors_before(self.before) | {CALIBRATED: self.predicted.errors}
        return MeasuredPoints(
            self.poses,
            errors,
            self.predicted.ambiguous,
            self.predicted.parameter_rms,
            self.predicted.scatter_rms,
        )

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, one sentence each."""
        remarks = [
            *verification_subsample_remark(self.sample, self.everywhere),
            *self.outdated,
            *self.poses.notes,
            *ignored_columns_remarks(self.poses, ("temperature",)),
            *self.temperatures,
            *([self.outside] if self.outside else []),
            *refit_remarks(self.predicted, self.poses, self.refit, self.better),
            *other_sides_remark(self.model, self.poses, self.predicted.expected_rms),
            *_distance_remark(self.distances),
            *lag_remark(self.lag),
        ]
        if self.uncalibrated:
            remarks.append(
                f"no calibration pose measured {' and '.join(self.uncalibrated)}: its position on the tool is the declared one, "
                "whose error is part of these numbers"
                + ("" if self.poses.in_socket.any() else "; --refit point fits it to these poses")
            )
        if self.fitted:
            which = " and ".join(self.fitted)
            remarks.append(
                f"the calibration was fitted to {which}, so errors at other poses may be larger; verify on poses outside the fit"
            )
        return tuple(remarks)

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(verification_checks(self._numbers, self.points))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("verification"), **self._numbers, "verdict": self.trust.document()}

    @property
    def _temperature(self) -> dict[str, Any] | None:
        """Temperatures of the points, how far they lie outside those of the calibration, and what an arm of aluminium grows by in that, as
        the 90th percentile at the points, mm.
        """
        warm, outside = self.poses.temperature, self.outside_temperatures
        if warm is None:
            return None
        growth = None
        if outside is not None:
            place = np.linalg.norm(seen_from_base(self.model, self.poses).position, axis=1)
            growth = ALUMINIUM * abs(outside) * float(np.percentile(place, 90)) / MILLIMETRE
        return {
            "lowest": float(warm.min()),
            "highest": float(warm.max()),
            "outside": outside,
            "growth_mm": growth,
        }

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        """Document without the verdict; `rms_mm` has the root mean square distances.

        `parameters` is what the parameters' covariance predicts, `expected` with instrument, robot and model error on top (null where
        neither instrument nor robot are known), `measured` what was found.
        """
        result = self.predicted
        measured = self.errors.in_millimetres()
        blocks = {"measured": measured, "measured_unambiguous": result.unambiguous.in_millimetres()}
        if self.as_calibrated is not None:
            blocks["as_calibrated"] = self.as_calibrated.all.in_millimetres()
        before = self.before.document()
        if before["registered"] is not None:
            blocks["nominal"] = before["registered"]
        return {
            "robot": self.model.name,
            "joints": {joint.name: joint.kind for joint in self.model.motor_joints},
            "backlash": list(self.model.backlash_joints),
            "before": before,
            "verification": blocks,
            "orientation": orientation_document(self.orientation_before, self.orientation),
            "refit": refit_document(self.refit, len(self.poses)),
            "refit_proposed": refit_document(self.better, len(self.poses)),
            "uncalibrated_points": list(self.uncalibrated),
            "distances": [item.document() for item in self.distances],
            "rms_mm": {
                "parameters": _rms(result.parameter_rms),
                "expected": _rms(result.expected_rms) if self.covariance.independent is not None else None,
                "measured": _rms(np.linalg.norm(result.errors, axis=1)),
            },
            "prediction": prediction_document(result, self.covariance),
            "ambiguous_poses": int(result.ambiguous.sum()),
            "lag": None if self.lag is None else self.lag.document(),
            "temperature": self._temperature,
            "sample": subsample_document(self.sample, self.everywhere),
            "fitted": list(self.fitted),
            "refused": self.refused,
            "remarks": list(self.remarks),
            **self.record.document(),
        }


def verify(
    robot: CalibratedRobot,
    poses: PoseSet,
    *,
    refit: Sequence[Refit] = (),
    temperature: float | None = None,
    progress: Progress = silent,
) -> Verification:
    """Compare a calibrated robot with points measured outside the fit.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    poses : PoseSet
        Joint positions (N, n) in rad or m and measured points (N, 3) in m, or contacts of a ball with sockets, none of them fitted.
    refit : sequence of {"station", "point"}
        What is placed anew by these poses, the instrument or the measured points; the geometry stays, and errors are then leave-one-out.
    temperature : float, optional
        Temperature of the arm, °C, for points that have none; by default that at which the calibrated parameters hold.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Verification
        Its `errors`, `residuals`, `before`, `summary()`, `report(path)` and `write(folder)`.

    Raises
    ------
    FlexcalError
        For measured lengths, where a station was not calibrated and is not refitted, for a socket with one contact, for contacts and
        points together, and for a refit of contacts.

    Examples
    --------
    >>> from flexcal import RobotModel, calibrate, read_poses, verify
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> calibration = calibrate(model, poses, terms=["kinematic"])
    >>> verification = verify(calibration.robot, read_poses("examples/ur5_tracker/random.csv", model))
    >>> print(f"{verification.errors.mean * 1e3:.1f} mm")
    0.1 mm
    """
    require_points(poses)
    poses, warm = with_temperature(robot, poses, temperature)
    held = bool(poses.in_socket.any())
    if held:
        _require_contacts(poses, refit)
    else:
        require_stations(robot, poses, "station" in refit)
    turned, measured = poses, poses.without_orientations()
    sample = StratifiedSample.of(measured)
    if held and sample is not None:
        sample = replace(sample, rows=sample.rows[repeated_contacts(measured.subset(sample.rows))])
    poses = measured if sample is None else measured.subset(sample.rows)
    turned = turned if sample is None else turned.subset(sample.rows)
    unmeasured = tuple(name for name in poses.targets if name not in robot.measured)
    model = robot.probable if unmeasured else robot.model
    stands = anew = contacts = None
    if held:
        contacts = verify_contacts(model, robot.nominal, poses, known=robot.only_sockets)
        standing, verified = contacts.model, (contacts.result, contacts.covariance)
        before, registered = contacts.before, None
    else:
        known = all(is_station_identified(model, station) for station in poses.stations)
        stands = prediction_errors_with_covariance(model, poses) if known else None
        anew = verify_refitted(model, poses, refit) if refit else None
        verified = stands if anew is None else (anew.result, anew.covariance)
        standing = model if anew is None else anew.model
        uncalibrated = uncalibrated_model(robot.nominal, poses)
        before, registered = uncalibrated.errors(poses), uncalibrated.registered
    assert verified is not None
    return Verification(
        model=standing,
        poses=poses,
        predicted=verified[0],
        covariance=verified[1],
        before=before,
        refit=anew,
        as_calibrated=stands[0] if stands is not None and refit else None,
        better=proposed_refit(model, poses, verified[0]) if anew is None and not held else None,
        uncalibrated=() if "point" in refit else unmeasured,
        outside="" if held else outside_ranges(robot, measured.q),
        fitted=fitted_points(robot, poses),
        refused=robot.refused,
        outdated=outdated_remarks(robot),
        sample=sample,
        everywhere=None if sample is None else _errors_everywhere(standing, measured, progress),
        orientation=orientation_errors(standing, turned),
        orientation_before=uncalibrated_orientations(registered, turned),
        temperatures=warm,
        outside_temperatures=kelvin_outside(robot, poses.temperature),
        distances=() if contacts is None else contacts.distances,
    )


def _errors_everywhere(model: RobotModel, poses: PoseSet, progress: Progress) -> ErrorStatistics:
    """Errors of a calibrated robot at any number of points, or of contacts about the mean of each socket."""
    if not poses.in_socket.any():
        return all_errors(model, poses, progress)
    ball = predicted_positions(model, poses, progress=progress)
    return ErrorStatistics.of(about_sockets(ball, socket_numbers(poses)))


def _require_contacts(poses: PoseSet, refit: Sequence[Refit]) -> None:
    """Raise `FlexcalError` for contacts with sockets that verify nothing, and for a `refit` of them."""
    if refit:
        raise FlexcalError(
            "E-RUN-113",
            "where a socket is follows from the contacts with it, and nothing else is fitted to these: leave --refit out, or, where the "
            "ball was replaced, calibrate with these contacts.",
        )
    require_contacts(poses)


def verify_robot(
    robot_file: Path,
    files: Sequence[Path],
    *,
    estimates: Path | None = None,
    refit: Sequence[Refit] = (),
    temperature: float | None = None,
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Verification:
    """`verify` of the robot of a robot.yaml on files of measured poses.

    `estimates` is an estimates.yaml, or a folder with one, in place of that beside robot.yaml; with `out`, results.json, points.csv,
    arm.npz and report.html are left in that folder. Raises `FlexcalError` as reading and `verify` do.
    """
    files = tables_of(files)
    require_distinct_files(files)
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    progress("reading", 0.0)
    poses = _read(robot, files)
    progress("reading", 1.0)
    verification = verify(robot, poses, refit=refit, temperature=temperature, progress=progress)
    origin = provenance([robot_file, robot.nominal.urdf, *files], None, robot.stored, tuple(robot.blocks))
    origin |= image_provenance(files)
    fitted = fitted_files(robot, files) or verification.fitted
    result = replace(verification, fitted=fitted, record=RunRecord(origin, command))
    if out is not None:
        result.write(out)
    return result


def verification_poses(
    robot: CalibratedRobot, files: Sequence[Path], *, placed_again: bool = False
) -> PoseSet:
    """Measured points of the `files`, from stations estimated by the calibration, or any with `placed_again`.

    Raises `FlexcalError` where they are not that.
    """
    poses = _read(robot, files)
    require_stations(robot, poses, placed_again)
    return poses


def _read(robot: CalibratedRobot, files: Sequence[Path]) -> PoseSet:
    poses = read_poses(list(files), robot.model, require_motion=False)
    require_points(poses, " and ".join(str(file) for file in files))
    return poses


def require_stations(robot: CalibratedRobot, poses: PoseSet, placed_again: bool = False) -> None:
    """Raise `FlexcalError` for a ball in sockets, and for points measured from a station that the calibration did not place, unless it is
    `placed_again`.
    """
    if poses.in_socket.any():
        raise FlexcalError(
            "E-RUN-102",
            "contacts with sockets do not tell where a point is, because nobody knows where the fixture stands; give points of an "
            "instrument here, and the contacts to 'flexcal verify'.",
        )
    for station in poses.stations:
        if not placed_again and not is_station_identified(robot.model, station):
            raise FlexcalError(
                "E-RUN-008",
                f"the station '{station}' was not calibrated, so its position is unknown; add poses measured from there to the "
                "calibration, "
                "or fit it to these poses: 'flexcal verify' with --refit station.",
            )


def _distance_remark(distances: Sequence[SocketDistance]) -> tuple[str, ...]:
    """Sentence on the errors of the known distances between sockets; none without any."""
    if not distances:
        return ()
    worst = max(distances, key=lambda item: abs(item.error))
    errors, before, std = (
        None if None in values else _rms(np.array(values, float))
        for values in (
            [item.error for item in distances],
            [item.before for item in distances],
            [item.std for item in distances],
        )
    )
    predicted = "" if std is None else f", {std:.3f} mm predicted"
    was = "" if before is None else f"; before the calibration {before:.3f} mm"
    return (
        f"the {len(distances)} known distances between sockets are met to {errors:.3f} mm (rms{predicted}), at worst "
        f"{worst.error / MILLIMETRE:+.3f} mm from {worst.sockets[0]} to {worst.sockets[1]} at {worst.place}{was}",
    )


def _rms(distance: np.ndarray) -> float:
    """Root mean square (mm) of distances (N,) in m."""
    return float(np.sqrt(np.mean(distance**2))) / MILLIMETRE
