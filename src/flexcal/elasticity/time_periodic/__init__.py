"""Linear time-periodic effects of the slow reference motion: harmonic balance, friction pulses, drive torques, moving sensors."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
