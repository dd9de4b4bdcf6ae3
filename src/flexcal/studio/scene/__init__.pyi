from .colours import GHOST
from .link_shapes import LinkShapes
from .mesh_file import MeshFolder, MeshNotDrawn
from .robot_view import RobotView
from .surroundings import Surroundings

__all__ = [
    "GHOST",
    "LinkShapes",
    "MeshFolder",
    "MeshNotDrawn",
    "RobotView",
    "Surroundings",
]
