"""Cameras that see a board: corners in images, intrinsic parameters, and the pose of the board in every view."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
