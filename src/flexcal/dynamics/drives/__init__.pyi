from .backlash import with_play
from .gains import drive_gains
from .nominal_inertials import with_nominal_spread
from .stiffness_bias import attenuation

__all__ = [
    "attenuation",
    "drive_gains",
    "with_nominal_spread",
    "with_play",
]
