"""Filtered motions and torques of recordings, and checks of faulty logs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
