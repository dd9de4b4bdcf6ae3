from .approaches import other_sides_remark
from .fits import Fits, FitSettings, sampled
from .fitted_measurements import fitted_files, fitted_points, measurement_digests
from .held_out import held_out_group
from .ignored_columns import ignored_columns_remarks
from .job import calibrate_robot
from .joint_ranges import outside_ranges
from .odd_temperatures import plausible_temperatures, with_plausible_temperatures
from .procedure import calibrate, requested_terms
from .remarks import lag_remark
from .result import Calibration
from .subsample import subsample_document, verification_subsample_remark

__all__ = [
    "Calibration",
    "FitSettings",
    "Fits",
    "calibrate",
    "calibrate_robot",
    "fitted_files",
    "fitted_points",
    "held_out_group",
    "ignored_columns_remarks",
    "lag_remark",
    "measurement_digests",
    "other_sides_remark",
    "outside_ranges",
    "plausible_temperatures",
    "requested_terms",
    "sampled",
    "subsample_document",
    "verification_subsample_remark",
    "with_plausible_temperatures",
]
