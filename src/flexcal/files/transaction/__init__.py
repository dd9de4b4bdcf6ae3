"""Files of one run: written whole and put in place together; read where they are regular and of bounded size."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
