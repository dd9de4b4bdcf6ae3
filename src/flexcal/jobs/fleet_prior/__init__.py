"""Prior of a robot's geometry from other calibrated robots of its model."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
