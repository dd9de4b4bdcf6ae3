from .cell import HardCell
from .counterparts import counterparts
from .description import ArmDescription, read_description
from .drawn import HardRobot, draw_robot

__all__ = ["ArmDescription", "HardCell", "HardRobot", "counterparts", "draw_robot", "read_description"]
