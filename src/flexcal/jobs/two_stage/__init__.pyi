from .job import run_two_stage
from .results import TwoStageRun

__all__ = [
    "TwoStageRun",
    "run_two_stage",
]
