"""A calibrated robot against positions that its calibration never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration import ErrorStatistics, Verification, require_points, verify
from flexcal.data import PoseSet, provenance, read_poses, sha256_of
from flexcal.errors import FlexcalError
from flexcal.report.verification import VerificationStudy, write_verification_report
from flexcal.units import MILLIMETRE
from flexcal.workflow.calibrate_robot import nominal_errors
from flexcal.workflow.calibrated_robot import calibrated_robot
from flexcal.workflow.distinct_files import require_distinct
from flexcal.workflow.pose_remarks import unused_columns
from flexcal.workflow.results import write_results


@dataclass(frozen=True, eq=False)
class RobotVerification:
    """Errors of the calibrated robot at `poses`, and `nominal`: those of the uncalibrated one after a rigid registration.

    `nominal` is None with fewer than four poses, which a registration fits too well to say anything; `fitted` are the files among them
    that the calibration was made from.
    """

    poses: PoseSet
    result: Verification
    nominal: ErrorStatistics | None
    fitted: tuple[str, ...]

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence each."""
        remarks = list(unused_columns(self.poses))
        if self.fitted:
            which = " and ".join(self.fitted)
            remarks.append(
                f"the calibration was fitted to {which}, so this says little about other poses; verify on poses that it never saw"
            )
        return tuple(remarks)

    def document(self) -> dict[str, Any]:
        """The content of results.json; `rms_mm` has the root mean square distances.

        `parameters` is what the parameters' covariance predicts, `expected` with the measurement's sigma on top (null where the files give
        none), `measured` what was found.
        """
        result = self.result
        measured = result.all.in_millimetres()
        blocks = {"measured": measured, "measured_unambiguous": result.unambiguous.in_millimetres()}
        if self.nominal is not None:
            blocks["nominal"] = self.nominal.in_millimetres()
        return {
            "verification": blocks,
            "rms_mm": {
                "parameters": _rms(result.expected_rms()),
                "expected": _rms(result.expected_rms(self.poses.sigma)) if self.poses.sigma_given else None,
                "measured": _rms(np.linalg.norm(result.errors, axis=1)),
            },
            "ambiguous_poses": int(result.ambiguous.sum()),
            "remarks": list(self.remarks),
        }


def verify_robot(
    robot: Path, files: Sequence[Path], *, estimates: Path | None = None, out: Path | None = None
) -> RobotVerification:
    """Predict the points of `files` with the calibrated robot and compare.

    `estimates` is an estimates.yaml, or a folder with one, in place of that beside robot.yaml; with `out`, results.json and
    report.html are left in that folder. Raises `FlexcalError` where there is no calibration, a station stands where no calibration pose was
    measured, or a file does not fit.
    """
    require_distinct(files)
    calibrated = calibrated_robot(robot, estimates, "verify")
    model, bare, blocks = calibrated.model, calibrated.nominal, calibrated.blocks
    poses = read_poses(list(files), model, require_motion=False)
    require_points(poses, " and ".join(str(file) for file in files))
    for station in poses.stations:
        if f"station.{station}.x" not in model.posterior.parameters:
            raise FlexcalError(
                f"the station '{station}' was not calibrated, so its place is unknown; add poses measured from there to the calibration."
            )
    before = nominal_errors(bare, poses) if _registrable(poses) else None
    nominal = None if before is None else ErrorStatistics.of(before)
    known = blocks["calibration"].provenance.values()
    fitted = tuple(file.name for file in files if sha256_of(file) in known)
    result = RobotVerification(poses, verify(model, poses), nominal, fitted)
    if out is not None:
        document = result.document()
        write_results(out, document)
        origin = provenance([robot, bare.urdf, *files], None, calibrated.stored, tuple(blocks))
        study = VerificationStudy(model, poses, result.result, before, origin, results=document)
        write_verification_report(out / "report.html", study)
    return result


def _rms(distance: np.ndarray) -> float:
    """Root mean square (mm) of distances (N,) in m."""
    return float(np.sqrt(np.mean(distance**2))) / MILLIMETRE


def _registrable(poses: PoseSet) -> bool:
    """Whether every station has the four points off a line that a registration with something left to say needs."""
    for station in poses.stations:
        points = poses.position[poses.station == station]
        if len(points) < 4 or np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-3) < 2:
            return False
    return True
