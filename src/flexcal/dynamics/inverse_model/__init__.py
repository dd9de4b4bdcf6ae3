"""Inverse dynamic identification model, linear in its parameters: observation matrix, base parameters, torque terms of the drives."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
