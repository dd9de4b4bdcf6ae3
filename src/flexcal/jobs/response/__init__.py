"""Frequency responses from planned experiments and from records of any excitation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
