from .document import (
    NOT_RECORDED,
    RESULTS,
    Kind,
    RunRecord,
    dropped_parameters,
    header,
    identifiability_block,
    identifiability_spectrum,
    json_text,
    quantities,
    read_results,
    springs_block,
    write_results,
)
from .estimates import ESTIMATES, estimates_target
from .fitted_responses import read_fitted_responses, write_fitted_responses
from .points import read_arm, read_loads, read_points, write_arm, write_loads, write_points
from .response_arrays import read_response_arrays, write_response_arrays
from .tilts import read_tilts, write_tilts
from .torque_predictions import read_predictions, write_predictions
from .verification_points import VERIFICATION, read_verification, write_verification

__all__ = [
    "ESTIMATES",
    "NOT_RECORDED",
    "RESULTS",
    "VERIFICATION",
    "Kind",
    "RunRecord",
    "dropped_parameters",
    "estimates_target",
    "header",
    "identifiability_block",
    "identifiability_spectrum",
    "json_text",
    "quantities",
    "read_arm",
    "read_fitted_responses",
    "read_loads",
    "read_points",
    "read_predictions",
    "read_response_arrays",
    "read_results",
    "read_tilts",
    "read_verification",
    "springs_block",
    "write_arm",
    "write_fitted_responses",
    "write_loads",
    "write_points",
    "write_predictions",
    "write_response_arrays",
    "write_results",
    "write_tilts",
    "write_verification",
]
