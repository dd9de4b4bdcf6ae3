"""Friction terms of the drives and their selection by cross-validation and significance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
