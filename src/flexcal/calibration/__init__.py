"""Stage 2: geometry from measured points, with the elastic deflection taken into account, and its verification."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
