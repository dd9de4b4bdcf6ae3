from .compare_step import CompareStep

__all__ = ["CompareStep"]
