from .description import Description, Frame, locked_joints, read_urdf
from .elements import Element, read_elements
from .serial_arm import AmbiguousArm, Arm, find_arm

__all__ = [
    "AmbiguousArm",
    "Arm",
    "Description",
    "Element",
    "Frame",
    "find_arm",
    "locked_joints",
    "read_elements",
    "read_urdf",
]
