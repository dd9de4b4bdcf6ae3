from .accuracy_volume import AccuracyVolume
from .collisions import colliding_links
from .colour_scale import ColourScale
from .colours import BLOCKED, COLLIDING, GHOST, INSTRUMENT, LINE_OF_SIGHT, LINK, MEASURED, SELECTED, TARGET
from .draggable_point import DraggablePoint
from .instrument import Instrument
from .link_shapes import LinkShapes
from .mesh_file import MeshFolder, MeshNotDrawn
from .motion import Motion
from .points import Points
from .residual_arrows import ResidualArrows
from .robot_view import RobotView
from .surroundings import Surroundings
from .working_box import WorkingBox, box_edges

__all__ = [
    "BLOCKED",
    "COLLIDING",
    "GHOST",
    "INSTRUMENT",
    "LINE_OF_SIGHT",
    "LINK",
    "MEASURED",
    "SELECTED",
    "TARGET",
    "AccuracyVolume",
    "ColourScale",
    "DraggablePoint",
    "Instrument",
    "LinkShapes",
    "MeshFolder",
    "MeshNotDrawn",
    "Motion",
    "Points",
    "ResidualArrows",
    "RobotView",
    "Surroundings",
    "WorkingBox",
    "box_edges",
    "colliding_links",
]
