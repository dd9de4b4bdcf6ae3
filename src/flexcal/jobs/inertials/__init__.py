"""Identification of link inertials, rotors and friction from planned trajectories, with CAD as the prior."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
