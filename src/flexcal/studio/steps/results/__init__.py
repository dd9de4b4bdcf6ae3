"""Results of commands as their folders have them, which calibration and verification show alike."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
