from .joint_limits import check_joint_limits, check_joint_units
from .parquet_sizes import require_decodable
from .signals import (
    JOINT_QUANTITIES,
    TIMESTAMP,
    UNITS,
    VECTORS,
    ZEROS,
    Signal,
    assign,
    mapped_signals,
    standard_columns,
    timestamp_columns,
)
from .streaming import streamed_table
from .tabular_file import (
    LARGEST_TABLE,
    MOST_COLUMNS,
    Table,
    TableFile,
    open_table,
    require_table,
    tables_in,
    write_frame,
    write_table,
)
from .timestamps import STAMP, seconds_of, with_seconds

__all__ = [
    "JOINT_QUANTITIES",
    "LARGEST_TABLE",
    "MOST_COLUMNS",
    "STAMP",
    "TIMESTAMP",
    "UNITS",
    "VECTORS",
    "ZEROS",
    "Signal",
    "Table",
    "TableFile",
    "assign",
    "check_joint_limits",
    "check_joint_units",
    "mapped_signals",
    "open_table",
    "require_decodable",
    "require_table",
    "seconds_of",
    "standard_columns",
    "streamed_table",
    "tables_in",
    "timestamp_columns",
    "with_seconds",
    "write_frame",
    "write_table",
]
