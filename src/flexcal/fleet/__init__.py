"""Statistics of many robots: spread over robots of one model, outlying robots, trends over time, and when a limit is reached."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
