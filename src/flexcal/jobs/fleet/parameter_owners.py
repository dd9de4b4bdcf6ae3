"""Which parameters say something of a robot itself."""

from __future__ import annotations

from collections.abc import Iterable, Set

from flexcal.calibration.fit import OF_THE_CELL

_OF_THE_SETUP = (*OF_THE_CELL, "sensor.", "scatter.", "payload.", "force_sensor.")
"""Beginnings of parameters that say how was measured, or what was mounted, and nothing of the robot."""
_OF_THE_BASE = ("offset", "misalignment_1", "misalignment_2", "length_z")
"""Errors of a joint on the base that another place of the base, or of the instrument, looks like: offset, tilts, and length along it."""


def is_of_robot(name: str, absorbed: Iterable[str], base: Set[str]) -> bool:
    """Whether a parameter is one of the robot, wherever it stands and whatever it carries; `absorbed` are those that it absorbed, `base`
    the joints on the base.
    """
    return not any(_is_of_setup(each, base) for each in (name, *absorbed))


def _is_of_setup(name: str, base: Set[str]) -> bool:
    owner, _, key = name.rpartition(".")
    return name.startswith(_OF_THE_SETUP) or (owner in base and key in _OF_THE_BASE)
