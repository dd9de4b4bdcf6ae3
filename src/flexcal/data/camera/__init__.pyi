from .board import board_corners
from .board_symmetry import half_turns
from .bundle import FEWEST_CORNERS, FreeViews, View, free_views, lens_prior
from .detection import detected_views
from .lens import Lens, projected
from .poses_of_views import ViewPoses, view_poses

__all__ = [
    "FEWEST_CORNERS",
    "FreeViews",
    "Lens",
    "View",
    "ViewPoses",
    "board_corners",
    "detected_views",
    "free_views",
    "half_turns",
    "lens_prior",
    "projected",
    "view_poses",
]
