"""Calibrated model and tool targets to the motor commands that put the real tool there."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
