"""Building blocks of pages and figures: content blocks, number formats, colours, rendering to HTML."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
