from .cell import VirtualCell
from .config import CellConfig, FrictionConfig, LoopConfig, MismatchConfig, SensorConfig, SpreadConfig
from .sensors import encoder_resolution
from .true_parameters import draw_truth, read_truth, read_truth_of, write_truth

__all__ = [
    "CellConfig",
    "FrictionConfig",
    "LoopConfig",
    "MismatchConfig",
    "SensorConfig",
    "SpreadConfig",
    "VirtualCell",
    "draw_truth",
    "encoder_resolution",
    "read_truth",
    "read_truth_of",
    "write_truth",
]
