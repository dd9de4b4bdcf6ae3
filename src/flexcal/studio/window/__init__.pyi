from .command_box import CommandBox
from .course_figure import error_course
from .entry import entry_form
from .figures_panel import FiguresPanel
from .fold import add_fold
from .joint_units import joint_unit
from .links import file_link, heading, step_link
from .magnified_arrows import MagnifiedArrows
from .markup import Tone, command_text, facts, paragraph, picked_rows, table
from .place import Place
from .report_figures import ReportFigures, figure_tab
from .report_view import add_sections, add_verdict
from .selection import Selection, pose_keys
from .step import Step
from .window import Window

__all__ = [
    "CommandBox",
    "FiguresPanel",
    "MagnifiedArrows",
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
    "entry_form",
    "error_course",
    "facts",
    "figure_tab",
    "file_link",
    "heading",
    "joint_unit",
    "paragraph",
    "picked_rows",
    "pose_keys",
    "step_link",
    "table",
]
