"""Guided measuring: judgement of every row as it comes, the next best pose, when to stop, and the rows' file."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
