from .assembly import RegressionData, Subsystem, assemble_regression, batches_each
from .batches import (
    Batch,
    ExperimentSystem,
    batch_length,
    batched,
    experiment_system,
    joined_systems,
    reduced,
)
from .blocks import RegressionBlock, regression_blocks
from .covariance import (
    BatchCovariance,
    batch_covariance,
    covariance_of_scores,
    mixed_covariance,
    offset_scores,
    parameter_rows,
    score_covariance,
)
from .cross_validation import Fold, fold_numbers, folds, prediction_errors, solutions
from .cutoff_selection import ContinuousSamples, CutoffChoice, choose_cutoff, pieces
from .scores import Scores
from .triangular_factor import TriangularFactor, stacked, triangular

__all__ = [
    "Batch",
    "BatchCovariance",
    "ContinuousSamples",
    "CutoffChoice",
    "ExperimentSystem",
    "Fold",
    "RegressionBlock",
    "RegressionData",
    "Scores",
    "Subsystem",
    "TriangularFactor",
    "assemble_regression",
    "batch_covariance",
    "batch_length",
    "batched",
    "batches_each",
    "choose_cutoff",
    "covariance_of_scores",
    "experiment_system",
    "fold_numbers",
    "folds",
    "joined_systems",
    "mixed_covariance",
    "offset_scores",
    "parameter_rows",
    "pieces",
    "prediction_errors",
    "reduced",
    "regression_blocks",
    "score_covariance",
    "solutions",
    "stacked",
    "triangular",
]
