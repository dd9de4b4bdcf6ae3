"""Identification of the place of a tool's tip from touches of fixed points."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
