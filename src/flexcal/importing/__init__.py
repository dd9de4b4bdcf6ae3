"""Files of other programs: meaning and units of their columns, and a plausibility check with the robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
