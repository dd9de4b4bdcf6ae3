from .calibrate_step import CalibrateStep

__all__ = ["CalibrateStep"]
