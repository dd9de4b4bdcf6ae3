"""Files of other programs: what their columns are, in which units, and whether that can be true of this robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
