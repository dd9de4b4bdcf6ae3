"""Predicted accuracy over the working volume, error sources, repeatability and drift by ISO 9283."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
