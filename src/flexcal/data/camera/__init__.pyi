from .board import board_corners
from .bundle import FreeViews, View, free_views, lens_prior
from .detection import detected_views
from .lens import Lens, projected
from .poses_of_views import ViewPoses, view_poses

__all__ = [
    "FreeViews",
    "Lens",
    "View",
    "ViewPoses",
    "board_corners",
    "detected_views",
    "free_views",
    "lens_prior",
    "projected",
    "view_poses",
]
