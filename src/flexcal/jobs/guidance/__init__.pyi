from .followed_file import FollowedFile, ReadingGoesOn
from .judgement import Finding, Judgement, JudgementCode
from .measured_rows import MeasuredRow, MeasuredRows, Source
from .outlook import Outlook, Prospect
from .pose_choice import PoseChoice
from .row_cells import RowReader, cells_of, in_columns
from .session import DEFAULT_CHOICE, GuidedSession

__all__ = [
    "DEFAULT_CHOICE",
    "Finding",
    "FollowedFile",
    "GuidedSession",
    "Judgement",
    "JudgementCode",
    "MeasuredRow",
    "MeasuredRows",
    "Outlook",
    "PoseChoice",
    "Prospect",
    "ReadingGoesOn",
    "RowReader",
    "Source",
    "cells_of",
    "in_columns",
]
