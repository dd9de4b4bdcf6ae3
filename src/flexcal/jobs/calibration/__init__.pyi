from .fitted_measurements import already_fitted, measurement_digests
from .ignored_columns import ignored_columns_remarks
from .job import calibrate_robot
from .joint_ranges import outside_ranges
from .procedure import calibrate
from .result import Calibration
from .subsample import subsample_document, verification_subsample_remark

__all__ = [
    "Calibration",
    "already_fitted",
    "calibrate",
    "calibrate_robot",
    "ignored_columns_remarks",
    "measurement_digests",
    "outside_ranges",
    "subsample_document",
    "verification_subsample_remark",
]
