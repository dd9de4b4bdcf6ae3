"""Recordings, measured poses, plans and estimates: what they are, how they are read and written, where they come from."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
