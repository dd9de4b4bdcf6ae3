"""How a maker's six-joint arms stand when all joint positions of their controllers are zero."""

from __future__ import annotations

from dataclasses import dataclass

Direction = tuple[float, float, float]


@dataclass(frozen=True)
class ArmAtZero:
    """Directions of the six `axes`, and of the `lower_arm` from axis 2 to axis 3, in the controller's base frame at joint positions zero.

    They say the signs and the zeros of the joints, and so whether a URDF counts joint positions as the controller does. Where
    `base_at_axis_2`, the origin of the controller's base frame lies on axis 1 at the height of axis 2, else at the arm's foot.
    """

    axes: tuple[Direction, Direction, Direction, Direction, Direction, Direction]
    lower_arm: Direction
    base_at_axis_2: bool = False
