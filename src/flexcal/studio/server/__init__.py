"""The server of the studio's window: one user, known by a token, on one port of this machine."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
