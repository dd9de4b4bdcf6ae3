"""Stage 1: from frequency responses to the stiffness and damping of drives and bearings, with true uncertainties."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
