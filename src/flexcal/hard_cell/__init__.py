"""A virtual cell that is independent of the identified model, with effects that the model lacks."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
