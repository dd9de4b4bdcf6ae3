"""The studio: the whole calibration in a browser window, on the folder that the command line uses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
