"""The one-file HTML reports: what was found, how sure it is, and where it came from, for engineers who have not read the paper."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
