from .program import Program, ProgramTarget, RunTimeTarget
from .urscript import parse_urscript

__all__ = ["Program", "ProgramTarget", "RunTimeTarget", "parse_urscript"]
