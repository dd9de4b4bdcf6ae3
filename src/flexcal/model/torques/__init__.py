"""Joint torques as a linear map of inertial parameters, energies and external loads."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
