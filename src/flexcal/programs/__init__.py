"""Robot programs: the targets written in them as numbers, and the program with other numbers there and every other byte kept."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
