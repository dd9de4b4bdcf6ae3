"""Planning of calibration poses, exciting trajectories and frequency experiments, and their measurement."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
