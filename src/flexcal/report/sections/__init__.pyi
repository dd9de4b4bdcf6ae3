from .base_parameters import base_parameters_section
from .changed_robot import change_section
from .first_screen import error_range, headline_facts
from .fleet_parameters import parameter_spreads_section
from .fleet_trends import trends_section
from .friction import friction_section
from .geometry import ARROW_FACTORS, arm_figure, error_figures, exaggeration, geometry_section
from .headline_numbers import comparison_section
from .held_out import held_out_section
from .identifiability import identifiability_blocks
from .learned_residual import learned_section
from .learning_curve import learning_section
from .link_inertials import link_inertials_section
from .measured_words import MeasuredWords
from .orientations import orientation_tables
from .parameters import coverage, parameter_figures, parameter_table
from .provenance import common_origin, input_files, provenance_section
from .residuals import residual_blocks, residuals_section
from .response_levels import levels_block
from .selected_terms import terms_section
from .signal_processing import signals_table
from .springs import hardening_sentence, hysteresis_sentence, spring_table, unseen_springs
from .stiffness import response_blocks, stiffness_section
from .study_coverage import coverage_range, coverage_section
from .study_effects import effects_section
from .study_resampling import resampling_section
from .temperature import temperature_section
from .tilts import tilts_section
from .torques import recording_labels, torque_blocks
from .uncalibrated import uncalibrated_ranges, uncalibrated_rows, uncalibrated_table
from .uncertainty_budget import budget_table, noise_tables
from .verification import verification_section

__all__ = [
    "ARROW_FACTORS",
    "MeasuredWords",
    "arm_figure",
    "base_parameters_section",
    "budget_table",
    "change_section",
    "common_origin",
    "comparison_section",
    "coverage",
    "coverage_range",
    "coverage_section",
    "effects_section",
    "error_figures",
    "error_range",
    "exaggeration",
    "friction_section",
    "geometry_section",
    "hardening_sentence",
    "headline_facts",
    "held_out_section",
    "hysteresis_sentence",
    "identifiability_blocks",
    "input_files",
    "learned_section",
    "learning_section",
    "levels_block",
    "link_inertials_section",
    "noise_tables",
    "orientation_tables",
    "parameter_figures",
    "parameter_spreads_section",
    "parameter_table",
    "provenance_section",
    "recording_labels",
    "resampling_section",
    "residual_blocks",
    "residuals_section",
    "response_blocks",
    "signals_table",
    "spring_table",
    "stiffness_section",
    "temperature_section",
    "terms_section",
    "tilts_section",
    "torque_blocks",
    "trends_section",
    "uncalibrated_ranges",
    "uncalibrated_rows",
    "uncalibrated_table",
    "unseen_springs",
    "verification_section",
]
