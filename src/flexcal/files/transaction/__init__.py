"""Files of one run that are put in place together or not at all, with recovery after interruption."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
