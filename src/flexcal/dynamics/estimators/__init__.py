"""Estimators of the dynamic parameters: least squares and its variants, instrumental variables, Kalman filter, maximum likelihood."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
