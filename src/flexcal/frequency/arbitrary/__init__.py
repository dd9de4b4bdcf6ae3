"""Frequency responses from records with arbitrary excitation: spectra, local polynomial method, feedback, usable band."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
