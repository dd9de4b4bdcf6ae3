"""Checks of a calibration: drift, implausible shifts, position of the bearing axes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
