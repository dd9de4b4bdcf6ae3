"""How a dialect writes poses and joint positions: units, orientation and decimals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.programs.orientation import Orientation
from flexcal.programs.pose import Pose
from flexcal.units import DEGREE, MILLIMETRE

_FARTHEST = 1e3
"""Distance, m, that no tool, target or frame of a robot has from another."""
_LARGEST = 1e6
"""Size that no other number of a target has, in any dialect."""


@dataclass(frozen=True)
class Notation:
    """Units, orientation and decimals of a dialect; the numbers of a pose are three of its position and then those of its orientation.

    Attributes
    ----------
    length : float
        Unit of lengths, m.
    angle : float
        Unit of angles, rad.
    orientation : Orientation
        Representation of an orientation.
    decimals : int
        Decimals of new numbers at most; zeros at the end are left out.
    fixed : bool
        Whether new numbers always have all decimals, and are right-aligned where the old ones were.
    """

    length: float
    angle: float
    orientation: Orientation
    decimals: int
    fixed: bool = False

    @property
    def units(self) -> str:
        """Units of lengths and angles."""
        return f"{'mm' if self.length == MILLIMETRE else 'm'} and {'°' if self.angle == DEGREE else 'rad'}"

    def fault(self, numbers: Sequence[float], *, joints: bool = False) -> str:
        """Why the numbers are no pose, or no joint positions, of a robot; empty where they may be."""
        if not joints and max(map(abs, numbers[:3])) * self.length > _FARTHEST:
            return f"its position is more than {_FARTHEST:g} m away: correct its numbers"
        if max(map(abs, numbers if joints else numbers[3:])) > _LARGEST:
            return f"it has a number beyond {_LARGEST:g}: correct it"
        return "" if joints or self.orientation.is_valid(numbers[3:]) else "its orientation is no quaternion"

    def pose(self, numbers: Sequence[float]) -> Pose:
        """Pose that the numbers mean; raises `FlexcalError` where they can be none."""
        if fault := self.fault(numbers):
            shown = ", ".join(f"{number:.6g}" for number in numbers)
            raise FlexcalError("E-PROG-021", f"the pose [{shown}] cannot be used, as {fault}.")
        position = np.array(numbers[:3]) * self.length
        return Pose(position, self.orientation.rotation(numbers[3:], self.angle))

    def pose_numbers(self, pose: Pose, old: Sequence[float]) -> tuple[float, ...]:
        """Numbers of a pose; of several that mean the same, those nearest to `old`."""
        position = (pose.position / self.length).tolist()
        return (*position, *self.orientation.numbers(pose.rotation, old[3:], self.angle))

    def text(self, value: float, old: str) -> str:
        """Text of a number without an exponent, in place of the text `old`."""
        text = f"{value:.{self.decimals}f}"
        if not self.fixed:
            text = text.rstrip("0")
            text = text + "0" if text.endswith(".") else text
        text = text.removeprefix("-") if not float(text) else text
        return text.rjust(len(old)) if self.fixed else text

    def keeps(self, value: float, old: float) -> bool:
        """Whether a number differs so little from the old one that its text stays as it is."""
        return abs(value - old) <= 0.5 * 10.0**-self.decimals
