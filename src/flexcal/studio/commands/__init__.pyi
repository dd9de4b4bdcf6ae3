from .command_run import CommandRun
from .runner import CommandRunner

__all__ = ["CommandRun", "CommandRunner"]
