from .by_file_name import read_foreign

__all__ = [
    "read_foreign",
]
