"""A fleet: results of many robots and visits in one table, and what they say of each robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
