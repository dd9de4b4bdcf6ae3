"""Customer's version of a report, from a folder of calibrate or verify."""

from __future__ import annotations

from pathlib import Path

from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.jobs.pages.report import calibration_study, missing_key_error
from flexcal.jobs.result_files import read_points, read_results
from flexcal.report.checks import Trust, calibration_checks, verification_checks
from flexcal.report.pages import CustomerStudy, write_customer_report
from flexcal.report.results import MeasurementDetails
from flexcal.report.sections import input_files

CUSTOMER = "customer.html"


def customer_report(folder: Path, particulars: MeasurementDetails) -> Path:
    """Write customer.html of a folder of `fit_geometry` or `prediction_errors`.

    Raises `InputError` for the folder of another verb, and where a file is not there or cannot be read.
    """
    results, path = read_results(folder), folder / CUSTOMER
    try:
        if results["kind"] == "verification":
            points, origin = read_points(folder, sigma=DEFAULT_SIGMA), results["provenance"]
            trust = Trust(verification_checks(results, points))
        elif results["kind"] == "calibration":
            study = calibration_study(folder)
            points, origin = study.points, study.estimate.provenance
            trust = Trust(calibration_checks(results, study.estimate, points))
        else:
            raise InputError(
                "E-REPORT-007",
                f"{folder} holds no calibration or verification of measured points; give a folder that calibrate or verify "
                "wrote with --out.",
            )
        write_customer_report(path, CustomerStudy(results, points, trust, input_files(origin), particulars))
    except KeyError as problem:
        raise missing_key_error(folder, problem) from problem
    return path
