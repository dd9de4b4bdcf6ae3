from .command_box import CommandBox
from .figures_panel import FiguresPanel
from .markup import command_text, facts, paragraph, picked_rows, table
from .selection import Selection
from .step import Step
from .window import Window

__all__ = [
    "CommandBox",
    "FiguresPanel",
    "Selection",
    "Step",
    "Window",
    "command_text",
    "facts",
    "paragraph",
    "picked_rows",
    "table",
]
