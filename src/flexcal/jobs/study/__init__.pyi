from .job import run_study
from .rows import StudyRow
from .study_file import StudyPlan, read_study

__all__ = ["StudyPlan", "StudyRow", "read_study", "run_study"]
