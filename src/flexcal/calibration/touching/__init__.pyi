from .touched_tip import TipFit, fit_tip

__all__ = [
    "TipFit",
    "fit_tip",
]
