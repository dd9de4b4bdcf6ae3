"""The one-file HTML reports: what was found, how sure it is, and where it came from, for engineers who have not read the paper."""

from flexcal.report.publication import TX90L_PAPER, Publication
from flexcal.report.study import TwoStageStudy
from flexcal.report.two_stage import two_stage_page, write_two_stage_report

__all__ = ["TX90L_PAPER", "Publication", "TwoStageStudy", "two_stage_page", "write_two_stage_report"]
