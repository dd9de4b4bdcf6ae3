from .directions import Directions, declared_level, inclinometer, is_inclinometer
from .kind import Kind
from .registry import ANGULAR, KINDS, LOCATING, kind_of, tells_lengths
from .rigid_motions import LEAST_REGISTERED, best_motion, rigid_motion, wrong_readings
from .robust_start import turn_to_z
from .sockets import Sockets, about_sockets, declared_distances, socket_numbers

__all__ = [
    "ANGULAR",
    "KINDS",
    "LEAST_REGISTERED",
    "LOCATING",
    "Directions",
    "Kind",
    "Sockets",
    "about_sockets",
    "best_motion",
    "declared_distances",
    "declared_level",
    "inclinometer",
    "is_inclinometer",
    "kind_of",
    "rigid_motion",
    "socket_numbers",
    "tells_lengths",
    "turn_to_z",
    "wrong_readings",
]
