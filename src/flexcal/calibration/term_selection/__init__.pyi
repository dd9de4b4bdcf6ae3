from .cross_validation import CrossValidation, TermSelection, cross_validated, select_terms
from .stored_trials import considered_document, considered_terms
from .trials import ConsideredTerm

__all__ = [
    "ConsideredTerm",
    "CrossValidation",
    "TermSelection",
    "considered_document",
    "considered_terms",
    "cross_validated",
    "select_terms",
]
