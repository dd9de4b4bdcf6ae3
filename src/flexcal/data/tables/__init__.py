"""Strict reading of CSV and Parquet tables and conversion of columns to SI units."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
