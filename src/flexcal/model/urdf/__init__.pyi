from .description import Description, Frame, read_urdf
from .elements import Element, macro_in, read_elements, xacro_error
from .in_pinocchio import locked_joints, pinocchio_model
from .serial_arm import AmbiguousArm, Arm, find_arm

__all__ = [
    "AmbiguousArm",
    "Arm",
    "Description",
    "Element",
    "Frame",
    "find_arm",
    "locked_joints",
    "macro_in",
    "pinocchio_model",
    "read_elements",
    "read_urdf",
    "xacro_error",
]
