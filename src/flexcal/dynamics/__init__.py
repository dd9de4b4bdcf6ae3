"""Recordings to dynamic parameters: base parameters, drive terms, least squares with intervals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
