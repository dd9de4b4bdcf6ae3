from .fitted_response import FittedResponse, fitted_responses
from .identifiability import Determined
from .measured_response import MeasuredResponse, in_words, relative_to_diagonal
from .particulars import NOT_GIVEN, Particulars
from .published_values import TX90L_PAPER, Publication
from .run_significance import LEVEL, ParameterChanges, parameter_changes
from .runs import Comparison, Run
from .two_stage_study import TwoStageStudy

__all__ = [
    "LEVEL",
    "NOT_GIVEN",
    "TX90L_PAPER",
    "Comparison",
    "Determined",
    "FittedResponse",
    "MeasuredResponse",
    "ParameterChanges",
    "Particulars",
    "Publication",
    "Run",
    "TwoStageStudy",
    "fitted_responses",
    "in_words",
    "parameter_changes",
    "relative_to_diagonal",
]
