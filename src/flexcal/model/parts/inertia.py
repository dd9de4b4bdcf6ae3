"""Inertia of a link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass (kg), centre of mass (3,) in the link frame (m), inertia (3, 3) about the centre of mass in link axes (kg m²)."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray


def parallel_axis(mass: float, com: np.ndarray) -> np.ndarray:
    """Parallel-axis term of the inertia: its increase from the centre of mass to the frame's origin, (3, 3) kg m²."""
    return mass * ((com @ com) * np.eye(3) - np.outer(com, com))


LINK_PARAMETERS = ("mass", "mc_x", "mc_y", "mc_z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The ten parameters of a link in the order of the columns: mass (kg), first moment (kg m) and inertia (kg m²) at the joint frame.

Ixy, Ixz and Iyz are entries of the inertia matrix, as URDF has them: negative products of inertia.
"""
