"""`flexcal recheck`: whether a robot is as calibrated, by few measured poses; visits stored one after the other."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
