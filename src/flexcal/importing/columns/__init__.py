"""Meaning and units of a foreign table's columns, and their plausibility with the robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
