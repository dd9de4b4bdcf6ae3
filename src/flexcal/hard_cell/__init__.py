"""Independently implemented simulated robot cell, for tests of the virtual one."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
