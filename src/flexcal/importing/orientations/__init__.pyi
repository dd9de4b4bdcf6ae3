from .convention_choice import ConventionChoice, choose_convention
from .convention_fit import NominalPoses, OrientationFit, fit_orientations, odd_angle
from .conventions import Convention, EulerAngles, Quaternion, RotationVector, parse_convention
from .possible_conventions import angle_units, candidates, reordered_candidates

__all__ = [
    "Convention",
    "ConventionChoice",
    "EulerAngles",
    "NominalPoses",
    "OrientationFit",
    "Quaternion",
    "RotationVector",
    "angle_units",
    "candidates",
    "choose_convention",
    "fit_orientations",
    "odd_angle",
    "parse_convention",
    "reordered_candidates",
]
