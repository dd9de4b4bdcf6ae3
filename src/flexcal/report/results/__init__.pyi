from .chance_wording import chance_in_words
from .change_wording import amount, change_sentence, explanation_in_words
from .fitted_response import FittedResponse, fitted_responses
from .fleet_robots import TOLERANCE_STATES, is_drifting, tolerance_kept, with_trends
from .identifiability import IdentifiableParameters
from .measured_response import MeasuredResponse, relative_to_diagonal, uncertainty_sentence
from .particulars import NOT_GIVEN, MeasurementDetails
from .published_values import TX90L_PAPER, PublishedValues
from .run_significance import LEVEL, ParameterChanges, parameter_changes
from .runs import Comparison, Run
from .study_coverage import NOMINAL_COVERAGE, binomial_interval
from .study_effects import effect_probability, effect_sentence, explained_share, study_level_rows
from .study_summary import ABOUT_ALIKE, FEWEST_RESAMPLES, share_between, study_statistics
from .study_table import StudyTable
from .two_stage_study import TwoStageStudy

__all__ = [
    "ABOUT_ALIKE",
    "FEWEST_RESAMPLES",
    "LEVEL",
    "NOMINAL_COVERAGE",
    "NOT_GIVEN",
    "TOLERANCE_STATES",
    "TX90L_PAPER",
    "Comparison",
    "FittedResponse",
    "IdentifiableParameters",
    "MeasuredResponse",
    "MeasurementDetails",
    "ParameterChanges",
    "PublishedValues",
    "Run",
    "StudyTable",
    "TwoStageStudy",
    "amount",
    "binomial_interval",
    "chance_in_words",
    "change_sentence",
    "effect_probability",
    "effect_sentence",
    "explained_share",
    "explanation_in_words",
    "fitted_responses",
    "is_drifting",
    "parameter_changes",
    "relative_to_diagonal",
    "share_between",
    "study_level_rows",
    "study_statistics",
    "tolerance_kept",
    "uncertainty_sentence",
    "with_trends",
]
