from .robot_step import RobotStep

__all__ = ["RobotStep"]
