"""Verification of a calibrated robot on positions outside the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import StratifiedSample, all_errors
from flexcal.calibration.measurement import require_points
from flexcal.calibration.verification import (
    CALIBRATED,
    ErrorCovariance,
    MeasuredPoints,
    PredictionErrors,
    Refit,
    RefittedVerification,
    UncalibratedErrors,
    arms_at,
    errors_before,
    prediction_document,
    prediction_errors_with_covariance,
    uncalibrated_model,
    verify_refitted,
)
from flexcal.data.poses import PoseSet, read_poses
from flexcal.errors import FlexcalError
from flexcal.files.formats import provenance
from flexcal.jobs.accuracy.registration_refit import proposed_refit, refit_document, refit_remarks
from flexcal.jobs.calibration import (
    already_fitted,
    ignored_columns_remarks,
    outside_ranges,
    subsample_document,
    verification_subsample_remark,
)
from flexcal.jobs.inputs import (
    CalibratedRobot,
    calibrated_robot,
    is_station_identified,
    require_distinct_files,
)
from flexcal.jobs.pages import report_folder
from flexcal.jobs.result_files import RunRecord, header, write_arm, write_points, write_results
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust
from flexcal.report.pages import verification_checks
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class Verification:
    """Errors of the calibrated robot `model` at `poses`, and `before` those of the uncalibrated one.

    `covariance` is that of the errors, as predicted. `refit` says what was fitted to these poses, None where nothing: then `result` has
    leave-one-out errors, and `as_calibrated` those without. `better` has what would explain most of the errors placed again, None where
    nothing would. `uncalibrated` are points that the calibration did not measure and that were not refitted; `outside` says which poses
    lie outside the joint ranges of the calibration. `fitted` are the files among them that the calibration was made from, `record` says
    what all this comes from. Of very many points it is of a `sample`, and `everywhere` are the errors at all of them.
    """

    model: RobotModel
    poses: PoseSet
    result: PredictionErrors
    covariance: ErrorCovariance
    before: UncalibratedErrors
    refit: RefittedVerification | None
    as_calibrated: PredictionErrors | None
    better: RefittedVerification | None
    uncalibrated: tuple[str, ...]
    outside: str
    fitted: tuple[str, ...]
    record: RunRecord
    sample: StratifiedSample | None = None
    everywhere: ErrorStatistics | None = None

    @property
    def points(self) -> MeasuredPoints:
        """The points with the errors before and after."""
        errors = errors_before(self.before) | {CALIBRATED: self.result.errors}
        return MeasuredPoints(
            self.poses, errors, self.result.ambiguous, self.result.parameter_rms, self.result.scatter_rms
        )

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence each."""
        remarks = [
            *verification_subsample_remark(self.sample, self.everywhere),
            *ignored_columns_remarks(self.poses),
            *([self.outside] if self.outside else []),
            *refit_remarks(self.result, self.poses, self.refit, self.better),
        ]
        if self.uncalibrated:
            remarks.append(
                f"no calibration pose measured {' and '.join(self.uncalibrated)}: its position on the tool is the declared one, "
                "whose error is part of these numbers; --refit point fits it to these poses"
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

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        """Everything but the verdict; `rms_mm` has the root mean square distances.

        `parameters` is what the parameters' covariance predicts, `expected` with instrument, robot and model error on top (null where
        neither instrument nor robot are known), `measured` what was found.
        """
        result = self.result
        measured = (self.everywhere or result.all).in_millimetres()
        blocks = {"measured": measured, "measured_unambiguous": result.unambiguous.in_millimetres()}
        if self.as_calibrated is not None:
            blocks["as_calibrated"] = self.as_calibrated.all.in_millimetres()
        before = self.before.document()
        if before["registered"] is not None:
            blocks["nominal"] = before["registered"]
        return {
            "robot": self.model.name,
            "joints": {joint.name: joint.kind for joint in self.model.joints},
            "backlash": list(self.model.backlash_joints),
            "before": before,
            "verification": blocks,
            "refit": refit_document(self.refit, len(self.poses)),
            "refit_proposed": refit_document(self.better, len(self.poses)),
            "uncalibrated_points": list(self.uncalibrated),
            "rms_mm": {
                "parameters": _rms(result.parameter_rms),
                "expected": _rms(result.expected_rms) if self.covariance.independent is not None else None,
                "measured": _rms(np.linalg.norm(result.errors, axis=1)),
            },
            "prediction": prediction_document(result, self.covariance),
            "ambiguous_poses": int(result.ambiguous.sum()),
            "sample": subsample_document(self.sample, self.everywhere),
            "fitted": list(self.fitted),
            "remarks": list(self.remarks),
            **self.record.document(),
        }


def verify_robot(
    robot: Path,
    files: Sequence[Path],
    *,
    estimates: Path | None = None,
    refit: Sequence[Refit] = (),
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Verification:
    """Predict the points of `files` with the calibrated robot and compare.

    `refit` names what is placed anew by these poses, the instrument (`station`), the measured points (`point`) or both; the geometry
    stays, and errors are then leave-one-out. `estimates` is an estimates.yaml, or a folder with one, in place of that beside robot.yaml;
    with `out`, results.json, points.csv, arm.npz and report.html are left in that folder. Raises `FlexcalError` where there is no
    calibration, a station stands where no calibration pose was measured and is not refitted, or a file does not fit.
    """
    require_distinct_files(files)
    calibrated = calibrated_robot(robot, estimates, "verify")
    bare, blocks = calibrated.nominal, calibrated.blocks
    progress("reading", 0.0)
    measured = verification_poses(calibrated, files, placed_again="station" in refit)
    sample = StratifiedSample.of(measured)
    poses = measured if sample is None else measured.subset(sample.rows)
    progress("reading", 1.0)
    unmeasured = tuple(name for name in poses.targets if name not in calibrated.measured)
    model = calibrated.probable if unmeasured else calibrated.model
    before = uncalibrated_model(bare, poses).errors(poses)
    origin = provenance([robot, bare.urdf, *files], None, calibrated.stored, tuple(blocks))
    fitted = already_fitted(calibrated, files, poses)
    known = all(is_station_identified(model, station) for station in poses.stations)
    stands = prediction_errors_with_covariance(model, poses) if known else None
    anew = verify_refitted(model, poses, refit) if refit else None
    verified = stands if anew is None else (anew.result, anew.covariance)
    assert verified is not None
    standing = model if anew is None else anew.model
    result = Verification(
        model=standing,
        poses=poses,
        result=verified[0],
        covariance=verified[1],
        before=before,
        refit=anew,
        as_calibrated=stands[0] if stands is not None and refit else None,
        better=proposed_refit(model, poses, verified[0]) if anew is None else None,
        uncalibrated=() if "point" in refit else unmeasured,
        outside=outside_ranges(calibrated, measured.q),
        fitted=fitted,
        record=RunRecord(origin, command),
        sample=sample,
        everywhere=None if sample is None else all_errors(standing, measured, progress),
    )
    if out is not None:
        write_results(out, result.document())
        write_points(out, result.points)
        write_arm(out, arms_at(model, poses, result.points.shown))
        report_folder(out)
    return result


def verification_poses(
    calibrated: CalibratedRobot, files: Sequence[Path], *, placed_again: bool = False
) -> PoseSet:
    """Measured points of the `files`, from stations that the calibration found, or any with `placed_again`.

    Raises `FlexcalError` where they are not that.
    """
    model = calibrated.model
    poses = read_poses(list(files), model, require_motion=False)
    require_points(poses, " and ".join(str(file) for file in files))
    for station in poses.stations:
        if not placed_again and not is_station_identified(model, station):
            raise FlexcalError(
                "E-RUN-008",
                f"the station '{station}' was not calibrated, so its position is unknown; add poses measured from there to the "
                "calibration, "
                "or fit it to these poses: 'flexcal verify' with --refit station.",
            )
    return poses


def _rms(distance: np.ndarray) -> float:
    """Root mean square (mm) of distances (N,) in m."""
    return float(np.sqrt(np.mean(distance**2))) / MILLIMETRE
