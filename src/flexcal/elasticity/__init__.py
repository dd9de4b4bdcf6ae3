"""Stage 1: stiffness and damping of drives and bearings from frequency responses, with their uncertainties."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
