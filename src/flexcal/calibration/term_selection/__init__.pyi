from .cross_validation import (
    CONDITIONAL,
    CrossValidation,
    TermSelection,
    cross_validated,
    select_terms,
)
from .stored_trials import considered_document, considered_terms
from .trials import TermComparison

__all__ = [
    "CONDITIONAL",
    "CrossValidation",
    "TermComparison",
    "TermSelection",
    "considered_document",
    "considered_terms",
    "cross_validated",
    "select_terms",
]
