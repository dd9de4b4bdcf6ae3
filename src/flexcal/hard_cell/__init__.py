"""A virtual cell that is not made from the model of the identification: its robot errs in ways which that model cannot follow."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
