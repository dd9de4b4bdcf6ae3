"""The report of a folder that a verb filled before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from flexcal.data import read_estimates
from flexcal.data.pose_set import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.report.calibration import CalibrationStudy, write_calibration_report
from flexcal.report.dynamics import DynamicsStudy, write_dynamics_report
from flexcal.report.stored import StoredStudy, write_stored_report
from flexcal.report.verification import VerificationStudy, write_verification_report
from flexcal.units import MILLIMETRE
from flexcal.workflow.experiment_files import read_responses
from flexcal.workflow.point_files import POINTS, read_arm, read_points
from flexcal.workflow.prediction_files import read_predictions
from flexcal.workflow.results import RESULTS, read_results
from flexcal.workflow.stored_block import ESTIMATES

REPORT = "report.html"
_REPORTED = ("calibration", "verification", "stage1")
_DYNAMICS, _CALIBRATION, _VERIFICATION = "base_parameters", "term_selection", "rms_mm"
"""What results.json of `identify dynamics`, `calibrate` and `verify` holds, and no other."""


def report_folder(folder: Path) -> Path:
    """Write report.html of a folder from what a verb left in it: results.json and, as they are there, estimates, points or responses.

    Raises `InputError` where there are no results, or none that a report could show, and where a file cannot be read.
    """
    if not (folder / RESULTS).is_file():
        raise InputError(
            f"{folder} holds no {RESULTS}; give the folder that demo, identify dynamics or stiffness, calibrate or verify left "
            "with --out."
        )
    results, path = read_results(folder), folder / REPORT
    if not any(key in results for key in (*_REPORTED, _DYNAMICS)):
        raise InputError(
            f"{folder / RESULTS} holds no calibration, verification, stiffness or dynamics; give the folder of one of these."
        )
    try:
        if _DYNAMICS in results:
            write_dynamics_report(path, _dynamics_study(folder, results))
        elif _VERIFICATION in results:
            points = read_points(folder, sigma=DEFAULT_SIGMA)
            write_verification_report(path, VerificationStudy(results, points, read_arm(folder)))
        elif _CALIBRATION in results:
            write_calibration_report(path, calibration_study(folder))
        else:
            write_stored_report(path, _stored_study(folder, results))
    except KeyError as problem:
        raise InputError(
            f"{folder / RESULTS} lacks {problem}, as if another program or an older flexcal had left it; run the verb that leaves it again."
        ) from problem
    return path


def calibration_study(folder: Path) -> CalibrationStudy:
    """What `calibrate` left in a folder; raises `InputError` where a file is not there or cannot be read."""
    results, path = read_results(folder), folder / ESTIMATES
    estimates = read_estimates(path)
    if "calibration" not in estimates:
        raise InputError(f"{path} holds no calibration; run calibrate again.")
    points = read_points(folder, sigma=results["fit"]["sigma_mm"] * MILLIMETRE)
    return CalibrationStudy(results, estimates["calibration"], points, read_arm(folder))


def _dynamics_study(folder: Path, results: dict[str, Any]) -> DynamicsStudy:
    path = folder / ESTIMATES
    estimates = read_estimates(path) if path.is_file() else {}
    if "dynamics" not in estimates:
        raise InputError(f"{path} holds no dynamics; run identify dynamics again.")
    return DynamicsStudy(results, estimates["dynamics"], read_predictions(folder))


def _stored_study(folder: Path, results: dict[str, Any]) -> StoredStudy:
    path = folder / ESTIMATES
    measured = (folder / POINTS).is_file()
    return StoredStudy(
        name=folder.resolve().name,
        results=results,
        estimates=read_estimates(path) if path.is_file() else {},
        responses=read_responses(sorted(folder.glob("response_pose_*.npz")))[1],
        errors=_verification_errors(folder / "verification.csv"),
        points=read_points(folder, sigma=DEFAULT_SIGMA) if measured else None,
        arms=read_arm(folder) if measured else None,
    )


def _verification_errors(path: Path) -> dict[str, np.ndarray]:
    """Errors (N, 3) m of the elastic and the rigid model, from the table that a two-stage run leaves."""
    if not path.is_file():
        return {}
    try:
        table = pl.read_csv(path)
        truth = table.select("x", "y", "z").to_numpy()
        return {
            kind: truth - table.select(f"{kind}_x", f"{kind}_y", f"{kind}_z").to_numpy()
            for kind in ("elastic", "rigid")
        }
    except (pl.exceptions.PolarsError, TypeError) as problem:
        raise InputError(
            f"{path} cannot be read ({' '.join(str(problem).split())}); run the verb that leaves it again."
        ) from problem
