from .folder_result import FolderResult
from .residuals_view import ResidualsView
from .result_source import ResultSource

__all__ = ["FolderResult", "ResidualsView", "ResultSource"]
