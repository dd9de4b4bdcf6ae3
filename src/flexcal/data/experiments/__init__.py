"""Experiments as folders of recorded files, and the interface of measurement sources."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
