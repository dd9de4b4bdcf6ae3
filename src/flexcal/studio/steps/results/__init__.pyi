from .folder_result import FolderResult
from .residuals_view import ResidualsView

__all__ = ["FolderResult", "ResidualsView"]
