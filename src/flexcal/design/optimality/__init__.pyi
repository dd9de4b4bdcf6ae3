from .condition_criteria import ColumnCondition, LeastEigenvalue, condition_number
from .criteria import Criterion, DOptimal, Observability, SpectralCriterion, TraceOptimal, observability
from .exchange_algorithm import exchange
from .lower_bound import least_trace
from .rank_updates import Selection, greedy
from .shortlist import choose

__all__ = [
    "ColumnCondition",
    "Criterion",
    "DOptimal",
    "LeastEigenvalue",
    "Observability",
    "Selection",
    "SpectralCriterion",
    "TraceOptimal",
    "choose",
    "condition_number",
    "exchange",
    "greedy",
    "least_trace",
    "observability",
]
