"""Reports, comparisons and customers' versions, made from the folders written by jobs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
