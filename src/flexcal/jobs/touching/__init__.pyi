from .result import TouchIdentification, half_widths, millimetres

__all__ = [
    "TouchIdentification",
    "half_widths",
    "millimetres",
]
