"""Report of a folder written by a verb.

Parts of `pages` and `result_files` are loaded where they are named, so that a page loads its own alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_estimates
from flexcal.files.transaction import current_path
from flexcal.jobs import result_files
from flexcal.jobs.result_files import ESTIMATES, RESULTS, Kind, read_results
from flexcal.report import pages
from flexcal.report.layout import Page, write_page
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.calibration.verification import MeasuredTilts
    from flexcal.frequency.periodic import FrequencyResponse
    from flexcal.report.results import TwoStageStudy

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
        return pages.actuators_page(results)
    if kind == "inertials":
        return pages.inertials_page(pages.InertialsStudy(results, _block(folder, "dynamics")))
    if kind == "gains":
        return pages.gains_page(results)
    if kind == "payload":
        return pages.payload_page(
            pages.PayloadStudy(results, _block(folder, "payload"), result_files.read_predictions(folder))
        )
    if kind == "recheck":
        return pages.recheck_page(pages.RecheckStudy(results["robot"], results))
    if kind == "dynamics":
        return pages.dynamics_page(
            pages.DynamicsStudy(results, _block(folder, "dynamics"), result_files.read_predictions(folder))
        )
    if kind == "verification":
        points = result_files.read_points(folder, sigma=DEFAULT_SIGMA)
        return pages.verification_page(
            pages.VerificationStudy(results, points, result_files.read_arm(folder))
        )
    if kind == "calibration":
        tilts = _tilts(folder, results)
        if tilts is not None and not results["calibration"]["selected"]["poses"]:
            return pages.inclination_page(
                pages.InclinationStudy(results, _block(folder, "calibration"), tilts)
            )
        return pages.calibration_page(calibration_study(folder))
    if kind == "demo":
        return pages.two_stage_page(two_stage_study(folder))
    if kind == "stiffness":
        stiffness = pages.StiffnessStudy(
            results, _block(folder, "stiffness"), result_files.read_fitted_responses(folder)
        )
        return pages.stiffness_page(stiffness)
    if kind == "study":
        return pages.study_page(stored_study(folder, results))
    if kind == "excitation":
        return pages.excitation_page(
            pages.ExcitationStudy(results, result_files.read_response_arrays(folder))
        )
    if kind == "response":
        return pages.response_page(pages.ResponseStudy(results, _responses(folder, results)))
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


def calibration_study(folder: Path) -> pages.CalibrationStudy:
    """Study read from a folder written by `fit_geometry`; raises `InputError` for missing or unreadable files."""
    results = read_results(folder)
    points = result_files.read_points(folder, sigma=results["fit"]["sigma_mm"] * MILLIMETRE)
    return pages.CalibrationStudy(
        results,
        _block(folder, "calibration"),
        points,
        result_files.read_arm(folder),
        result_files.read_loads(folder),
        _tilts(folder, results),
    )


def two_stage_study(folder: Path) -> TwoStageStudy:
    """Study read from a folder written by `demo`; raises `InputError` for missing or unreadable files."""
    from flexcal.data.plans import MultisinePlan, read_plan_of
    from flexcal.jobs.inputs import FREQUENCY_PLAN
    from flexcal.report.results import TX90L_PAPER, TwoStageStudy

    results = read_results(folder)
    fresh, exact = result_files.read_verification(folder / result_files.VERIFICATION)
    return TwoStageStudy(
        results=results,
        estimates=read_estimates(folder / ESTIMATES),
        plan=read_plan_of(folder / FREQUENCY_PLAN, MultisinePlan),
        responses=result_files.read_fitted_responses(folder),
        points=result_files.read_points(folder, sigma=DEFAULT_SIGMA),
        arms=result_files.read_arm(folder),
        fresh=fresh,
        exact=exact,
        paper=TX90L_PAPER if results["robot"] == "tx90l" else None,
    )


def stored_study(folder: Path, results: Mapping[str, Any]) -> pages.StudyReport:
    """Study with the statistics of the rows that are stored, of which there are more than when results.json was written while it runs."""
    from flexcal.report.results import StudyTable, study_statistics

    frame = result_files.read_study_rows(folder).frame
    failed = int(frame["error"].is_not_null().sum()) if "error" in frame.columns else 0
    count = {"total": results["tasks"]["total"], "done": len(frame), "failed": failed}
    table = StudyTable.of(frame, results)
    return pages.StudyReport({**results, "tasks": count, **study_statistics(table)}, table)


def _tilts(folder: Path, results: Mapping[str, Any]) -> MeasuredTilts | None:
    """Readings of inclinometers, where the calibration had some."""
    return result_files.read_tilts(folder) if results.get("inclination") else None


def _responses(folder: Path, results: Mapping[str, Any]) -> tuple[FrequencyResponse, ...]:
    from flexcal.frequency.periodic import FrequencyResponse

    return tuple(FrequencyResponse.load(folder / Path(entry["file"]).name) for entry in results["responses"])


def _block(folder: Path, block: Block) -> Estimate:
    path = folder / ESTIMATES
    estimates = read_estimates(path)
    if block not in estimates:
        raise InputError("E-REPORT-011", f"{path} holds no {block}; run the verb that writes it again.")
    return estimates[block]
