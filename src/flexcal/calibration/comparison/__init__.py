"""Comparison of two calibrations of one robot: whether it changed, what of it, and where the tool moved."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
