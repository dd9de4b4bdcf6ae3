from .atomic_writing import atomic_path, atomic_paths, write_text
from .file_kinds import refuse_irregular, refuse_linked_folder, refuse_stream
from .file_transaction import FileTransaction, Record, current_path, files_on_disk, left_over
from .growing_file import append_lines, whole_lines
from .ledger import LEDGER, Ledger, digest_on_disk, refuse_mixture
from .locks import locked, sole_holder
from .reading import (
    LARGEST,
    MEGABYTE,
    open_regular,
    read_bytes,
    read_text,
    real_path,
    regular_path,
    size_text,
    unpacked_limit,
)

__all__ = [
    "LARGEST",
    "LEDGER",
    "MEGABYTE",
    "FileTransaction",
    "Ledger",
    "Record",
    "append_lines",
    "atomic_path",
    "atomic_paths",
    "current_path",
    "digest_on_disk",
    "files_on_disk",
    "left_over",
    "locked",
    "open_regular",
    "read_bytes",
    "read_text",
    "real_path",
    "refuse_irregular",
    "refuse_linked_folder",
    "refuse_mixture",
    "refuse_stream",
    "regular_path",
    "size_text",
    "sole_holder",
    "unpacked_limit",
    "whole_lines",
    "write_text",
]
