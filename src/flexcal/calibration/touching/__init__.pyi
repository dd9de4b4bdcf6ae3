from .point_names import OtherOrder
from .touch_fit import TouchFit
from .touched_frame import FrameFit, SizeOfPoints, fit_frame
from .touched_tip import TipFit, fit_tip

__all__ = [
    "FrameFit",
    "OtherOrder",
    "SizeOfPoints",
    "TipFit",
    "TouchFit",
    "fit_frame",
    "fit_tip",
]
