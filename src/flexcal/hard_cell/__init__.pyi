from .cell import HardCell
from .description import ArmDescription, read_description
from .drawn import HardRobot, draw_robot
from .named_values import counterparts

__all__ = ["ArmDescription", "HardCell", "HardRobot", "counterparts", "draw_robot", "read_description"]
