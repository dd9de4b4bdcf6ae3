from .applied_force import force_moments
from .deflected_tool import ToolAtRest, carried_mass, points_kinematics, tool_at_rest
from .equilibrium import (
    Equilibrium,
    elastic_axes,
    gravity_moments,
    gravity_torque,
    lateral_axes,
    lateral_slopes,
    rotations_by_geometry,
    spring_loads,
    static_equilibrium,
)
from .flank import are_flanks_certain, certain_flank
from .hardening import REFERENCE_TWIST, tangent_ratio, twist_by_hardening, twist_from_torque
from .transmission import transmission_columns

__all__ = [
    "REFERENCE_TWIST",
    "Equilibrium",
    "ToolAtRest",
    "are_flanks_certain",
    "carried_mass",
    "certain_flank",
    "elastic_axes",
    "force_moments",
    "gravity_moments",
    "gravity_torque",
    "lateral_axes",
    "lateral_slopes",
    "points_kinematics",
    "rotations_by_geometry",
    "spring_loads",
    "static_equilibrium",
    "tangent_ratio",
    "tool_at_rest",
    "transmission_columns",
    "twist_by_hardening",
    "twist_from_torque",
]
