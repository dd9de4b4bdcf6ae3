from .checks import carried_links
from .description import Description, Frame, read_urdf
from .elements import LARGEST_URDF, Element, macro_in, read_elements, xacro_error
from .in_pinocchio import locked_joints, pinocchio_model, pinocchio_model_of, pinocchio_shapes
from .serial_arm import AmbiguousArm, Arm, find_arm

__all__ = [
    "LARGEST_URDF",
    "AmbiguousArm",
    "Arm",
    "Description",
    "Element",
    "Frame",
    "carried_links",
    "find_arm",
    "locked_joints",
    "macro_in",
    "pinocchio_model",
    "pinocchio_model_of",
    "pinocchio_shapes",
    "read_elements",
    "read_urdf",
    "xacro_error",
]
