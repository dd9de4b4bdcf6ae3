"""Identification of drive gains from joint logs with and without a payload of known mass."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
