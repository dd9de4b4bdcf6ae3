"""Covariance of measured points: error groups, variance components, restricted likelihood and error statistics."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
