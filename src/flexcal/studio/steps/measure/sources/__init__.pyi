from .followed import FileSource, FolderSource
from .row_source import RowSource
from .typed import TypedSource
from .virtual import VirtualSource

__all__ = ["FileSource", "FolderSource", "RowSource", "TypedSource", "VirtualSource"]
