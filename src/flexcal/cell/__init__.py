"""The virtual cell: a MuJoCo robot with a hidden truth, its controller and its instruments."""

from flexcal.cell.config import (
    CellConfig,
    FrictionConfig,
    LoopConfig,
    MismatchConfig,
    SensorConfig,
    SpreadConfig,
)
from flexcal.cell.truth import draw_truth, read_truth, read_truth_of, write_truth
from flexcal.cell.virtual_cell import VirtualCell

__all__ = [
    "CellConfig",
    "FrictionConfig",
    "LoopConfig",
    "MismatchConfig",
    "SensorConfig",
    "SpreadConfig",
    "VirtualCell",
    "draw_truth",
    "read_truth",
    "read_truth_of",
    "write_truth",
]
