"""The report of a folder that a verb filled before."""

from __future__ import annotations

from pathlib import Path

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
from flexcal.workflow.point_files import read_arm, read_points
from flexcal.workflow.results import RESULTS, read_results

REPORT = "report.html"
_REPORTED = ("calibration", "verification", "stage1")
_DYNAMICS = "base_parameters"
_CALIBRATION = "term_selection"
_VERIFICATION = "rms_mm"
"""What results.json of `identify dynamics`, `calibrate` and `verify` holds, and no other."""


def report_folder(folder: Path) -> Path:
    """Write report.html of a folder from its results.json and, where they are there, estimates, responses and verification.csv.

    Raises `InputError` where there are no results, or none that a report could show, and where a file cannot be read.
    """
    if not (folder / RESULTS).is_file():
        raise InputError(
            f"{folder} holds no {RESULTS}; give the folder that demo, identify dynamics or stiffness, calibrate or verify left "
            "with --out."
        )
    results = read_results(folder)
    if not any(key in results for key in (*_REPORTED, _DYNAMICS)):
        raise InputError(
            f"{folder / RESULTS} holds no calibration, verification, stiffness or dynamics; give the folder of one of these."
        )
    path, measured = folder / "estimates.yaml", sorted(folder.glob("response_pose_*.npz"))
    estimates = read_estimates(path) if path.is_file() else {}
    if _DYNAMICS in results:
        if "dynamics" not in estimates:
            raise InputError(f"{path} holds no dynamics; run identify dynamics again.")
        found = estimates["dynamics"]
        dynamics = DynamicsStudy(folder.resolve().name, results, found, provenance=found.provenance)
        write_dynamics_report(folder / REPORT, dynamics)
        return folder / REPORT
    if _VERIFICATION in results:
        points = read_points(folder, sigma=DEFAULT_SIGMA)
        verification = VerificationStudy(results, points, read_arm(folder))
        write_verification_report(folder / REPORT, verification)
        return folder / REPORT
    if _CALIBRATION in results:
        if "calibration" not in estimates:
            raise InputError(f"{path} holds no calibration; run calibrate again.")
        points = read_points(folder, sigma=results["fit"]["sigma_mm"] * MILLIMETRE)
        calibration = CalibrationStudy(results, estimates["calibration"], points, read_arm(folder))
        write_calibration_report(folder / REPORT, calibration)
        return folder / REPORT
    study = StoredStudy(
        name=folder.resolve().name,
        results=results,
        estimates=estimates,
        responses=read_responses(measured)[1],
        errors=_verification_errors(folder / "verification.csv"),
    )
    write_stored_report(folder / REPORT, study)
    return folder / REPORT


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
