from .config import CellConfig, FrictionConfig, LoopConfig, MismatchConfig, SensorConfig, SpreadConfig
from .truth import draw_truth, read_truth, read_truth_of, write_truth
from .virtual_cell import VirtualCell

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
