"""Joint logs for identification: preprocessing, checks, hold-out and regression systems, in one process or several."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
