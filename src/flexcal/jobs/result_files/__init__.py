"""Files that a job writes to its folder, and their readers: results.json, estimates, points, responses and torques."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
