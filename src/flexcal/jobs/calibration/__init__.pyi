from .fitted_measurements import fitted_among, measurement_digests
from .ignored_columns import unused_columns
from .job import RobotCalibration, calibrate_robot
from .joint_ranges import outside_ranges
from .subsample import sample_document, verified_sample

__all__ = [
    "RobotCalibration",
    "calibrate_robot",
    "fitted_among",
    "measurement_digests",
    "outside_ranges",
    "sample_document",
    "unused_columns",
    "verified_sample",
]
