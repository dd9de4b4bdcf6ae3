from .command_run import CommandRun, command_line
from .runner import CommandRunner

__all__ = ["CommandRun", "CommandRunner", "command_line"]
