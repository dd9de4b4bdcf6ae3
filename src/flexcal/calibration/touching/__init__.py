"""Fits to poses in which the tip of a tool touches something: errors of the arm there, place of the tip, place of a work object."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
