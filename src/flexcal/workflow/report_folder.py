"""The report of a folder that a verb filled before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flexcal.data.pose_set import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.estimates_file import Block, read_estimates
from flexcal.estimation import Estimate
from flexcal.report.calibration import CalibrationStudy, write_calibration_report
from flexcal.report.dynamics import DynamicsStudy, write_dynamics_report
from flexcal.report.gains import write_gains_report
from flexcal.report.inertials import InertialsStudy, write_inertials_report
from flexcal.report.stored import StoredStudy, write_stored_report
from flexcal.report.verification import VerificationStudy, write_verification_report
from flexcal.units import MILLIMETRE
from flexcal.workflow.experiment_files import read_responses
from flexcal.workflow.point_files import POINTS, read_arm, read_points
from flexcal.workflow.prediction_files import read_predictions
from flexcal.workflow.results import RESULTS, read_results
from flexcal.workflow.stored_block import ESTIMATES
from flexcal.workflow.two_stage_results import VERIFICATION, read_verification

REPORT = "report.html"
_REPORTED = ("calibration", "verification", "stage1")
_DYNAMICS, _INERTIALS, _GAINS = "base_parameters", "trajectories", "declared_gains"
OF_CALIBRATION, OF_VERIFICATION = "term_selection", "rms_mm"
"""What results.json of `identify dynamics`, `inertials` and `gains`, of `calibrate` and of `verify` holds, and no other."""


def report_folder(folder: Path) -> Path:
    """Write report.html of a folder from what a verb left in it: results.json and, as they are there, estimates, points or responses.

    Raises `InputError` where there are no results, or none that a report could show, and where a file cannot be read.
    """
    if not (folder / RESULTS).is_file():
        raise InputError(
            f"{folder} holds no {RESULTS}; give the folder that demo, an identify verb, calibrate or verify left with --out."
        )
    results, path = read_results(folder), folder / REPORT
    if not any(key in results for key in (*_REPORTED, _DYNAMICS, _INERTIALS, _GAINS)):
        raise InputError(
            f"{folder / RESULTS} holds no calibration, verification, stiffness or dynamics; give the folder of one of these."
        )
    try:
        if _INERTIALS in results:
            write_inertials_report(path, InertialsStudy(results, _block(folder, "dynamics")))
        elif _GAINS in results:
            write_gains_report(path, results)
        elif _DYNAMICS in results:
            dynamics = DynamicsStudy(results, _block(folder, "dynamics"), read_predictions(folder))
            write_dynamics_report(path, dynamics)
        elif OF_VERIFICATION in results:
            points = read_points(folder, sigma=DEFAULT_SIGMA)
            write_verification_report(path, VerificationStudy(results, points, read_arm(folder)))
        elif OF_CALIBRATION in results:
            write_calibration_report(path, calibration_study(folder))
        else:
            write_stored_report(path, _stored_study(folder, results))
    except KeyError as problem:
        raise lacking(folder, problem) from problem
    return path


def lacking(folder: Path, problem: KeyError) -> InputError:
    """Of a results.json that lacks a key."""
    return InputError(
        f"{folder / RESULTS} lacks {problem}, as if another program or an older flexcal had left it; run the verb that leaves it again."
    )


def calibration_study(folder: Path) -> CalibrationStudy:
    """What `calibrate` left in a folder; raises `InputError` where a file is not there or cannot be read."""
    results = read_results(folder)
    points = read_points(folder, sigma=results["fit"]["sigma_mm"] * MILLIMETRE)
    return CalibrationStudy(results, _block(folder, "calibration"), points, read_arm(folder))


def _block(folder: Path, block: Block) -> Estimate:
    path = folder / ESTIMATES
    estimates = read_estimates(path)
    if block not in estimates:
        raise InputError(f"{path} holds no {block}; run the verb that leaves it again.")
    return estimates[block]


def _stored_study(folder: Path, results: dict[str, Any]) -> StoredStudy:
    path = folder / ESTIMATES
    measured, fresh = (folder / POINTS).is_file(), folder / VERIFICATION
    return StoredStudy(
        name=folder.resolve().name,
        results=results,
        estimates=read_estimates(path) if path.is_file() else {},
        responses=read_responses(sorted(folder.glob("response_pose_*.npz")))[1],
        errors=read_verification(fresh).errors if fresh.is_file() else {},
        points=read_points(folder, sigma=DEFAULT_SIGMA) if measured else None,
        arms=read_arm(folder) if measured else None,
    )
