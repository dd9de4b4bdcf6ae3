"""What to measure: the poses that tell most about a robot's geometric errors, under its limits. Needs no data."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
