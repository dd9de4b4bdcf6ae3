from .backlash import with_backlash
from .gains import drive_gains
from .nominal_inertials import with_nominal_uncertainty
from .stiffness_bias import stiffness_attenuation

__all__ = [
    "drive_gains",
    "stiffness_attenuation",
    "with_backlash",
    "with_nominal_uncertainty",
]
