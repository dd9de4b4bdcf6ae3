from .changed_robot import model_before
from .comparison import compare_folders, folder_comparison
from .customer import customer_report
from .report import REPORT, folder_page, report_folder, two_stage_study
from .result import (
    Identification,
    PlottedFolder,
    PlottedResult,
    ReportedResult,
    Result,
    SummarisedResult,
    TorqueIdentification,
    WrittenResult,
    estimate_row,
    summary_row,
)

__all__ = [
    "REPORT",
    "Identification",
    "PlottedFolder",
    "PlottedResult",
    "ReportedResult",
    "Result",
    "SummarisedResult",
    "TorqueIdentification",
    "WrittenResult",
    "compare_folders",
    "customer_report",
    "estimate_row",
    "folder_comparison",
    "folder_page",
    "model_before",
    "report_folder",
    "summary_row",
    "two_stage_study",
]
