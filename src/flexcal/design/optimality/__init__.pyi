from .condition_criteria import ConditionNumberCriterion, SmoothMinimumEigenvalue, condition_number
from .criteria import Criterion, DOptimal, SpectralCriterion, TraceOptimal, observability
from .exchange_algorithm import exchange
from .lower_bound import TraceBound, trace_lower_bound
from .rank_updates import Selection, greedy
from .shortlist import exchange_on_shortlist

__all__ = [
    "ConditionNumberCriterion",
    "Criterion",
    "DOptimal",
    "Selection",
    "SmoothMinimumEigenvalue",
    "SpectralCriterion",
    "TraceBound",
    "TraceOptimal",
    "condition_number",
    "exchange",
    "exchange_on_shortlist",
    "greedy",
    "observability",
    "trace_lower_bound",
]
