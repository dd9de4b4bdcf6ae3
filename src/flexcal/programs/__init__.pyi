from .arm_at_zero import ArmAtZero
from .configuration import Configuration
from .dialect import Dialect
from .dialects import DIALECTS, dialect_of
from .fanuc import parse_fanuc
from .krl import parse_krl
from .notation import Notation
from .pose import Pose
from .program import Move, NewNumbers, Program, ProgramFile, ProgramTarget, RunTimeTarget
from .rapid import parse_rapid
from .urscript import parse_urscript

__all__ = [
    "DIALECTS",
    "ArmAtZero",
    "Configuration",
    "Dialect",
    "Move",
    "NewNumbers",
    "Notation",
    "Pose",
    "Program",
    "ProgramFile",
    "ProgramTarget",
    "RunTimeTarget",
    "dialect_of",
    "parse_fanuc",
    "parse_krl",
    "parse_rapid",
    "parse_urscript",
]
