from .atomic_writing import atomic_path, atomic_paths, write_text
from .file_kinds import refuse_irregular, refuse_stream
from .locks import lock_file
from .publication import FileTransaction, current_path
from .reading import MEGABYTE, open_regular, read_bytes, read_text, regular_path, size_text, unpacked_limit
from .recovery import recover
from .staging_folder import Stage, age, living_owner, stages_in

__all__ = [
    "MEGABYTE",
    "FileTransaction",
    "Stage",
    "age",
    "atomic_path",
    "atomic_paths",
    "current_path",
    "living_owner",
    "lock_file",
    "open_regular",
    "read_bytes",
    "read_text",
    "recover",
    "refuse_irregular",
    "refuse_stream",
    "regular_path",
    "size_text",
    "stages_in",
    "unpacked_limit",
    "write_text",
]
