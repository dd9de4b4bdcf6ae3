"""Essential parameters, plausibility of an estimate against gravity and force sensors, and predicted torques."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
