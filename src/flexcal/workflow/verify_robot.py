"""A calibrated robot against positions that its calibration never saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration import ErrorStatistics, Verification, verify
from flexcal.data import PoseSet, read_poses
from flexcal.errors import FlexcalError, InputError
from flexcal.model import RobotModel
from flexcal.model.stored import apply_estimates
from flexcal.units import MILLIMETRE
from flexcal.workflow.calibrate_robot import nominal_errors
from flexcal.workflow.results import write_results


@dataclass(frozen=True, eq=False)
class RobotVerification:
    """Errors of the calibrated robot at `poses`, and `nominal`: those of the uncalibrated one after a rigid registration.

    `nominal` is None with fewer than four poses, which a registration fits too well to say anything.
    """

    poses: PoseSet
    result: Verification
    nominal: ErrorStatistics | None

    def document(self) -> dict[str, Any]:
        """The content of results.json; `predicted_std_mm` is the mean 1σ of the distance that the calibration promises."""
        result = self.result
        measured = result.all.in_millimetres()
        blocks = {"measured": measured, "measured_unambiguous": result.unambiguous.in_millimetres()}
        if self.nominal is not None:
            blocks["nominal"] = self.nominal.in_millimetres()
        return {
            "verification": blocks,
            "predicted_std_mm": float(np.mean(result.std)) / MILLIMETRE,
            "ambiguous_poses": int(result.ambiguous.sum()),
        }


def verify_robot(
    robot: Path, files: Sequence[Path], *, estimates: Path | None = None, out: Path | None = None
) -> RobotVerification:
    """Predict the points of `files` with the calibrated robot and compare.

    `estimates` is an estimates.yaml, or a folder with one, in place of that beside robot.yaml; with `out`, results.json is left in
    that folder. Raises `FlexcalError` where there is no calibration, a station stands where no calibration pose was
    measured, or a file does not fit.
    """
    bare = RobotModel.from_yaml(robot, estimates=False)
    stored = _estimates_file(bare, estimates)
    model = apply_estimates(bare, stored)
    if "tool.length_x" not in model.posterior.parameters:
        raise InputError(
            f"{stored}: there is no calibration in it; run 'flexcal calibrate {robot} POSES…' first."
        )
    poses = read_poses(list(files), model, require_motion=False)
    if poses.length is not None:
        raise InputError(
            f"{files[0]} measures lengths of a wire, which cannot be verified yet; give points x, y, z."
        )
    for station in poses.stations:
        if f"station.{station}.x" not in model.posterior.parameters:
            raise FlexcalError(
                f"the station '{station}' was not calibrated, so its place is unknown; add poses measured from there to the calibration."
            )
    before = ErrorStatistics.of(nominal_errors(bare, poses)) if _registrable(poses) else None
    result = RobotVerification(poses, verify(model, poses), before)
    if out is not None:
        write_results(out, result.document())
    return result


def _estimates_file(model: RobotModel, given: Path | None) -> Path:
    path = model.path.parent / model.config.estimates if given is None else given
    path = path / "estimates.yaml" if path.is_dir() else path
    if not path.exists():
        raise InputError(
            f"{path} does not exist, so there is nothing to verify; run 'flexcal calibrate {model.path} POSES…' first."
        )
    return path


def _registrable(poses: PoseSet) -> bool:
    """Whether every station has the four points off a line that a registration with something left to say needs."""
    for station in poses.stations:
        points = poses.position[poses.station == station]
        if len(points) < 4 or np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-3) < 2:
            return False
    return True
