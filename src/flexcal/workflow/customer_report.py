"""The customer's version of a report, from a folder of calibrate or verify."""

from __future__ import annotations

from pathlib import Path

from flexcal.data.pose_set import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.report.calibration import calibration_checks
from flexcal.report.customer import CustomerStudy, write_customer_report
from flexcal.report.particulars import Particulars
from flexcal.report.sections.provenance import input_files
from flexcal.report.trust import Trust
from flexcal.report.verification import verification_checks
from flexcal.workflow.point_files import read_points
from flexcal.workflow.report_folder import OF_CALIBRATION, OF_VERIFICATION, calibration_study, lacking
from flexcal.workflow.results import read_results

CUSTOMER = "customer.html"


def customer_report(folder: Path, particulars: Particulars) -> Path:
    """Write customer.html of a folder of `calibrate` or `verify`.

    Raises `InputError` for the folder of another verb, and where a file is not there or cannot be read.
    """
    results, path = read_results(folder), folder / CUSTOMER
    try:
        if OF_VERIFICATION in results:
            points, origin = read_points(folder, sigma=DEFAULT_SIGMA), results["provenance"]
            trust = Trust(verification_checks(results, points))
        elif OF_CALIBRATION in results:
            study = calibration_study(folder)
            points, origin = study.points, study.estimate.provenance
            trust = Trust(calibration_checks(results, study.estimate, points))
        else:
            raise InputError(
                f"{folder} holds no calibration or verification of measured points; give a folder that calibrate or verify "
                "wrote with --out."
            )
        write_customer_report(path, CustomerStudy(results, points, trust, input_files(origin), particulars))
    except KeyError as problem:
        raise lacking(folder, problem) from problem
    return path
