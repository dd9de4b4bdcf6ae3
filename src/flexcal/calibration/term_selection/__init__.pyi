from .cross_validation import CrossValidation, TermSelection, cross_validated, select_terms
from .stored_trials import considered_document, considered_terms
from .trials import TermComparison

__all__ = [
    "CrossValidation",
    "TermComparison",
    "TermSelection",
    "considered_document",
    "considered_terms",
    "cross_validated",
    "select_terms",
]
