"""Joint logs on a uniform time base, their files, decimation and low-pass filters."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
