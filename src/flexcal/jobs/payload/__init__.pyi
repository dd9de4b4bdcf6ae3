from .job import RobotPayload, identify_robot_payload

__all__ = [
    "RobotPayload",
    "identify_robot_payload",
]
