"""Modal models and mass chains fitted to the spectra of whole records, with resonances and their intervals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
