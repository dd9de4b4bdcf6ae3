"""Units in which the window shows joint positions."""

from __future__ import annotations

from flexcal.model.parts import Joint
from flexcal.units import DEGREE, MILLIMETRE


def joint_unit(joint: Joint, turn: str = "deg") -> tuple[float, str]:
    """Size, rad or m, and symbol of the unit of a joint: degrees, with the symbol `turn`, or mm where it slides."""
    return (MILLIMETRE, "mm") if joint.kind == "prismatic" else (DEGREE, turn)
