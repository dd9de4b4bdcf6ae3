from .cells import CellName
from .job import run_two_stage
from .results import TwoStageRun

__all__ = [
    "CellName",
    "TwoStageRun",
    "run_two_stage",
]
