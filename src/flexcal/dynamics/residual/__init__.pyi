from .gaussian_process import GaussianProcess, require_scikit_learn
from .learned_torque import LearnedMotor, LearnedResidual
from .learning import BlockErrors, learn_residual
from .npz_file import LEARNED, read_learned_residual, require_learned_place, write_learned_residual
from .torque_errors import ResidualErrors, residual_errors

__all__ = [
    "LEARNED",
    "BlockErrors",
    "GaussianProcess",
    "LearnedMotor",
    "LearnedResidual",
    "ResidualErrors",
    "learn_residual",
    "read_learned_residual",
    "require_learned_place",
    "require_scikit_learn",
    "residual_errors",
    "write_learned_residual",
]
