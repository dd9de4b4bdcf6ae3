"""Frequency response matrices with their covariances from recordings of multisine experiments."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
