"""Accuracy of a robot: verification, map over the working volume, certificate and repeatability (ISO 9283)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
