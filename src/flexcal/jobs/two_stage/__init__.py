"""Demonstration: the complete two-stage calibration of a virtual robot, compared with its true parameters."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
