"""Independent tasks in this process, in processes of this machine, or on a Dask cluster; knows nothing of robots."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
