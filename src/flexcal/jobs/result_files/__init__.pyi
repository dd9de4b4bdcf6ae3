from .document import (
    RESULTS,
    dropped_parameters,
    identifiability_block,
    identifiability_spectrum,
    json_text,
    plain,
    quantities,
    read_results,
    springs_block,
    write_results,
)
from .estimates import ESTIMATES, place_of_block, store_block
from .fitted_responses import read_fitted, write_fitted
from .points import read_arm, read_loads, read_points, write_arm, write_loads, write_points
from .response_arrays import read_response_arrays, write_response_arrays
from .torque_predictions import read_predictions, write_predictions
from .verification_points import VERIFICATION, read_verification, write_verification

__all__ = [
    "ESTIMATES",
    "RESULTS",
    "VERIFICATION",
    "dropped_parameters",
    "identifiability_block",
    "identifiability_spectrum",
    "json_text",
    "place_of_block",
    "plain",
    "quantities",
    "read_arm",
    "read_fitted",
    "read_loads",
    "read_points",
    "read_predictions",
    "read_response_arrays",
    "read_results",
    "read_verification",
    "springs_block",
    "store_block",
    "write_arm",
    "write_fitted",
    "write_loads",
    "write_points",
    "write_predictions",
    "write_response_arrays",
    "write_results",
    "write_verification",
]
