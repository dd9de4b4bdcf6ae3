"""Predicted frequency responses of all poses, their parameters, model errors, weights and whitened residuals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
