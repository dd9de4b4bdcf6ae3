"""Check that no recording is given twice, or used for both fit and validation."""

from __future__ import annotations

from collections.abc import Sequence
from filecmp import cmp
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import real_path


def require_distinct_files(files: Sequence[Path], unseen: Sequence[Path] = ()) -> None:
    """Raise `InputError` for a file, or a copy of it, given twice among the `files` of a fit or those `unseen` by it, or in both."""
    for given in (files, unseen):
        for k, file in enumerate(given):
            if twin := _twin(file, given[:k]):
                told = "is given twice" if _same_place(file, twin) else f"holds the same as {twin}"
                raise InputError("E-RUN-044", f"{file} {told}; it would be used twice; name it once.")
    for file in unseen:
        if twin := _twin(file, files):
            told = "is fitted" if _same_place(file, twin) else f"holds the same as {twin}, which is fitted,"
            raise InputError(
                "E-RUN-045",
                f"{file} {told} and is given under --validate too; validation needs recordings outside the fit.",
            )


def _twin(file: Path, others: Sequence[Path]) -> Path | None:
    """First of the `others` that is this file or has its content."""
    return next((other for other in others if _same_place(file, other) or _same_content(file, other)), None)


def _same_place(file: Path, other: Path) -> bool:
    return real_path(file) == real_path(other)


def _same_content(file: Path, other: Path) -> bool:
    return file.is_file() and other.is_file() and cmp(file, other, shallow=False)
