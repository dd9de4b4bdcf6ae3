"""Folders with images and the table of the joint positions at which they were taken."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.data.poses.excluded_rows import EXCLUDED
from flexcal.data.tables import open_table
from flexcal.errors import InputError

_IMAGES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".tif", ".tiff")
_TABLES = (".csv", ".parquet")


def tables_of(paths: Sequence[str | Path]) -> list[Path]:
    """Paths of tables, with the only table in it for every folder of images.

    Raises `InputError` for a folder of images with no table, or several.
    """
    return [_table_of(Path(path)) for path in paths]


def images_of(table: Path) -> list[Path]:
    """Paths of the images that a table names, once each in their order; none for a table of other measurements."""
    file = open_table(table)
    if "image" not in file.columns:
        return []
    texts = {EXCLUDED, *file.text_columns()} - {"image"}
    others = [name for name in file.columns if name in texts]
    names = file.leaving_out(others).read(("image",)).columns["image"]
    return [table.parent / name for name in dict.fromkeys(names.tolist())]


def _table_of(path: Path) -> Path:
    if not path.is_dir():
        return path
    files = sorted(path.iterdir())
    images = [file for file in files if file.suffix.lower() in _IMAGES]
    tables = [file for file in files if file.suffix in _TABLES]
    if not images:
        return path
    if len(tables) != 1:
        there = f"{len(tables)} tables ({', '.join(file.name for file in tables)})" if tables else "no table"
        raise InputError(
            "E-POSES-067",
            f"{path} has {len(images)} images and {there}; it needs one with pose, the joint positions q1, q2 and so on, and image, the "
            "file's name.",
        )
    return tables[0]
