from .command_box import CommandBox
from .course_figure import error_course
from .figures_panel import FiguresPanel
from .fold import add_fold
from .links import file_link, heading, step_link
from .markup import Tone, command_text, facts, paragraph, picked_rows, table
from .place import Place
from .report_figures import ReportFigures
from .report_view import add_sections, add_verdict
from .selection import Selection
from .step import Step
from .window import Window

__all__ = [
    "CommandBox",
    "FiguresPanel",
    "Place",
    "ReportFigures",
    "Selection",
    "Step",
    "Tone",
    "Window",
    "add_fold",
    "add_sections",
    "add_verdict",
    "command_text",
    "error_course",
    "facts",
    "file_link",
    "heading",
    "paragraph",
    "picked_rows",
    "step_link",
    "table",
]
