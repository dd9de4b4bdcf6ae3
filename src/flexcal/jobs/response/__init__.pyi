from .planned import identify_response
from .unplanned import ExcitationOptions, identify_excitation

__all__ = [
    "ExcitationOptions",
    "identify_excitation",
    "identify_response",
]
