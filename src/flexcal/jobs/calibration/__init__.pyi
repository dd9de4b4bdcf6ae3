from .fitted_measurements import fitted_files, fitted_points, measurement_digests
from .ignored_columns import ignored_columns_remarks
from .job import calibrate_robot
from .joint_ranges import outside_ranges
from .procedure import calibrate
from .result import Calibration
from .subsample import subsample_document, verification_subsample_remark

__all__ = [
    "Calibration",
    "calibrate",
    "calibrate_robot",
    "fitted_files",
    "fitted_points",
    "ignored_columns_remarks",
    "measurement_digests",
    "outside_ranges",
    "subsample_document",
    "verification_subsample_remark",
]
