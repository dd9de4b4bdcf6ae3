"""Optimality criteria of sets of measurements, and the exchange algorithms that select by them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
