"""Setup of a robot: a robot.yaml from a URDF, import of measurements, and additions to robot.yaml."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
