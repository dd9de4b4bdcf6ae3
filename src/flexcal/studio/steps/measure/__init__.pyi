from .measure_step import MeasureStep

__all__ = ["MeasureStep"]
