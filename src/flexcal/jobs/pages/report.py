"""Report of a folder written by a verb."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexcal.calibration.verification import MeasuredTilts
from flexcal.data.plans import MultisinePlan, read_plan_of
from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_estimates
from flexcal.files.transaction import current_path
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.inputs import FREQUENCY_PLAN
from flexcal.jobs.result_files import (
    ESTIMATES,
    RESULTS,
    VERIFICATION,
    Kind,
    read_arm,
    read_fitted_responses,
    read_loads,
    read_points,
    read_predictions,
    read_response_arrays,
    read_results,
    read_study_rows,
    read_tilts,
    read_verification,
)
from flexcal.report.layout import Page, write_page
from flexcal.report.pages import (
    CalibrationStudy,
    DynamicsStudy,
    ExcitationStudy,
    InclinationStudy,
    InertialsStudy,
    PayloadStudy,
    RecheckStudy,
    ResponseStudy,
    StiffnessStudy,
    StudyReport,
    VerificationStudy,
    actuators_page,
    calibration_page,
    dynamics_page,
    excitation_page,
    gains_page,
    inclination_page,
    inertials_page,
    payload_page,
    recheck_page,
    response_page,
    stiffness_page,
    study_page,
    two_stage_page,
    verification_page,
)
from flexcal.report.results import TX90L_PAPER, StudyTable, TwoStageStudy, study_statistics
from flexcal.units import MILLIMETRE

REPORT = "report.html"


def report_folder(folder: Path) -> Path:
    """Write report.html of a verb's folder from results.json and, if present, estimates, points or responses.

    Raises `InputError` where there are no results, or none that a report could show, and where a file cannot be read.
    """
    path = folder / REPORT
    write_page(path, folder_page(folder))
    return path


def folder_page(folder: Path) -> Page:
    """The report of a verb's folder before it becomes HTML; raises as `report_folder`."""
    if not current_path(folder / RESULTS).is_file():
        raise InputError(
            "E-REPORT-008",
            f"{folder} holds no {RESULTS}; give the folder that demo, an identify verb, calibrate or verify wrote with --out.",
        )
    results = read_results(folder)
    try:
        return _page(folder, results, results["kind"])
    except KeyError as problem:
        raise missing_key_error(folder, problem) from problem


def _page(folder: Path, results: Mapping[str, Any], kind: Kind) -> Page:
    if kind == "actuators":
        return actuators_page(results)
    if kind == "inertials":
        return inertials_page(InertialsStudy(results, _block(folder, "dynamics")))
    if kind == "gains":
        return gains_page(results)
    if kind == "payload":
        return payload_page(PayloadStudy(results, _block(folder, "payload"), read_predictions(folder)))
    if kind == "recheck":
        return recheck_page(RecheckStudy(results["robot"], results))
    if kind == "dynamics":
        return dynamics_page(DynamicsStudy(results, _block(folder, "dynamics"), read_predictions(folder)))
    if kind == "verification":
        points = read_points(folder, sigma=DEFAULT_SIGMA)
        return verification_page(VerificationStudy(results, points, read_arm(folder)))
    if kind == "calibration":
        tilts = _tilts(folder, results)
        if tilts is not None and not results["calibration"]["selected"]["poses"]:
            return inclination_page(InclinationStudy(results, _block(folder, "calibration"), tilts))
        return calibration_page(calibration_study(folder))
    if kind == "demo":
        return two_stage_page(two_stage_study(folder))
    if kind == "stiffness":
        stiffness = StiffnessStudy(results, _block(folder, "stiffness"), read_fitted_responses(folder))
        return stiffness_page(stiffness)
    if kind == "study":
        return study_page(stored_study(folder, results))
    if kind == "excitation":
        return excitation_page(ExcitationStudy(results, read_response_arrays(folder)))
    if kind == "response":
        return response_page(ResponseStudy(results, _responses(folder, results)))
    raise InputError(
        "E-REPORT-009",
        f"{folder / RESULTS} holds no calibration, verification or identification; give the folder of one of these.",
    )


def missing_key_error(folder: Path, problem: KeyError) -> InputError:
    """Error for a results.json that lacks a key."""
    return InputError(
        "E-REPORT-010",
        f"{folder / RESULTS} lacks {problem}, as if another program or an older flexcal had written it; run the verb that writes it again.",
    )


def calibration_study(folder: Path) -> CalibrationStudy:
    """Study read from a folder written by `fit_geometry`; raises `InputError` for missing or unreadable files."""
    results = read_results(folder)
    points = read_points(folder, sigma=results["fit"]["sigma_mm"] * MILLIMETRE)
    return CalibrationStudy(
        results,
        _block(folder, "calibration"),
        points,
        read_arm(folder),
        read_loads(folder),
        _tilts(folder, results),
    )


def two_stage_study(folder: Path) -> TwoStageStudy:
    """Study read from a folder written by `demo`; raises `InputError` for missing or unreadable files."""
    results = read_results(folder)
    fresh, exact = read_verification(folder / VERIFICATION)
    return TwoStageStudy(
        results=results,
        estimates=read_estimates(folder / ESTIMATES),
        plan=read_plan_of(folder / FREQUENCY_PLAN, MultisinePlan),
        responses=read_fitted_responses(folder),
        points=read_points(folder, sigma=DEFAULT_SIGMA),
        arms=read_arm(folder),
        fresh=fresh,
        exact=exact,
        paper=TX90L_PAPER if results["robot"] == "tx90l" else None,
    )


def stored_study(folder: Path, results: Mapping[str, Any]) -> StudyReport:
    """Study with the statistics of the rows that are stored, of which there are more than when results.json was written while it runs."""
    frame = read_study_rows(folder).frame
    failed = int(frame["error"].is_not_null().sum()) if "error" in frame.columns else 0
    count = {"total": results["tasks"]["total"], "done": len(frame), "failed": failed}
    table = StudyTable.of(frame, results)
    return StudyReport({**results, "tasks": count, **study_statistics(table)}, table)


def _tilts(folder: Path, results: Mapping[str, Any]) -> MeasuredTilts | None:
    """Readings of inclinometers, where the calibration had some."""
    return read_tilts(folder) if results.get("inclination") else None


def _responses(folder: Path, results: Mapping[str, Any]) -> tuple[FrequencyResponse, ...]:
    return tuple(FrequencyResponse.load(folder / Path(entry["file"]).name) for entry in results["responses"])


def _block(folder: Path, block: Block) -> Estimate:
    path = folder / ESTIMATES
    estimates = read_estimates(path)
    if block not in estimates:
        raise InputError("E-REPORT-011", f"{path} holds no {block}; run the verb that writes it again.")
    return estimates[block]
