from .atomic_writing import atomic_path, atomic_paths, write_text
from .file_kinds import refuse_irregular, refuse_stream
from .locks import lock_file
from .publication import Publication, current
from .recovery import settle
from .staging_folder import Stage, age, living_owner, stages_in

__all__ = [
    "Publication",
    "Stage",
    "age",
    "atomic_path",
    "atomic_paths",
    "current",
    "living_owner",
    "lock_file",
    "refuse_irregular",
    "refuse_stream",
    "settle",
    "stages_in",
    "write_text",
]
