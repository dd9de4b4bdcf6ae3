from .cell import HardCell
from .description import ArmDescription, read_description
from .true_parameters import HardRobot, counterparts, draw_robot

__all__ = [
    "ArmDescription",
    "HardCell",
    "HardRobot",
    "counterparts",
    "draw_robot",
    "read_description",
]
