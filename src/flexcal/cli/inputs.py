"""Folders that a verb reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flexcal.publication import settle


def settle_inputs(parsed: Any) -> None:
    """Finish what a run that was cut off has left in the folders of all paths among the arguments, so that files of one run are read there.

    Raises `InputError` where that is not possible.
    """
    given = [
        item for value in vars(parsed).values() for item in (value if isinstance(value, tuple) else (value,))
    ]
    paths = [item for item in given if isinstance(item, Path)]
    for folder in {path if path.is_dir() else path.parent for path in paths}:
        settle(folder)
