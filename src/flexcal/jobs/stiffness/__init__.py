"""Identification of joint and bearing stiffness and damping from frequency responses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
