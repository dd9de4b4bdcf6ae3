"""Recheck of a calibrated robot at few poses: whether it is as calibrated, what changed, and what would have been found."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
