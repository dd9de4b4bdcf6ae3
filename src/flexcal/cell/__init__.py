"""The virtual cell: a MuJoCo robot with a hidden truth, its controller and its instruments."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
