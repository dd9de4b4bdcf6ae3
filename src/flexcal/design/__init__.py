"""Design of experiments: calibration poses, exciting trajectories and frequency experiments, from the model alone."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
