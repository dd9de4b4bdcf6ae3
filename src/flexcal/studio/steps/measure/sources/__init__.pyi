from .followed import FileSource, FolderSource
from .row_source import Measuring, RowSource
from .typed import TypedSource
from .virtual import VirtualSource

__all__ = ["FileSource", "FolderSource", "Measuring", "RowSource", "TypedSource", "VirtualSource"]
