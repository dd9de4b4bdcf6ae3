from .cross_validation import (
    CONDITIONAL,
    CrossValidation,
    TermSelection,
    cross_validated,
    enough_for_selection,
    select_terms,
)
from .geometry_levels import ZerosOrGeometry, asks_for_levels, zeros_or_geometry
from .stored_trials import considered_document, considered_terms
from .trials import TermComparison

__all__ = [
    "CONDITIONAL",
    "CrossValidation",
    "TermComparison",
    "TermSelection",
    "ZerosOrGeometry",
    "asks_for_levels",
    "considered_document",
    "considered_terms",
    "cross_validated",
    "enough_for_selection",
    "select_terms",
    "zeros_or_geometry",
]
