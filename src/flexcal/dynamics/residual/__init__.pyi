from .gaussian_process import GaussianProcess, require_scikit_learn
from .learned_torque import LearnedMotor, LearnedResidual
from .learning import CrossValidatedErrors, learn_residual
from .npz_file import LEARNED, read_learned_residual, require_residual_path, write_learned_residual
from .torque_errors import LearnedTorqueErrors, residual_errors

__all__ = [
    "LEARNED",
    "CrossValidatedErrors",
    "GaussianProcess",
    "LearnedMotor",
    "LearnedResidual",
    "LearnedTorqueErrors",
    "learn_residual",
    "read_learned_residual",
    "require_residual_path",
    "require_scikit_learn",
    "residual_errors",
    "write_learned_residual",
]
