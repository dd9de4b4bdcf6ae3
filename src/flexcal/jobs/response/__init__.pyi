from .planned import identify_response
from .unplanned import AxisResponse, ExcitationOptions, frequency_response, identify_excitation

__all__ = [
    "AxisResponse",
    "ExcitationOptions",
    "frequency_response",
    "identify_excitation",
    "identify_response",
]
