"""Recovery of runs that were cut off."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction.journal import primary_of, read_journal
from flexcal.files.transaction.locks import locked
from flexcal.files.transaction.staging_folder import lock_orphan, owner_of, remove_stage, stages_in


def recover(folder: str | Path) -> None:
    """Finish or discard what runs that were cut off have left in a folder, and wait where one is putting its files in place just now.

    A run that had its journal is finished, any other discarded, so that the files there are all of one run. Raises `InputError` where that
    is not possible.
    """
    folder = Path(os.path.realpath(folder))
    stages = stages_in(folder)
    if not stages:
        return
    for stage in stages:
        home = primary_of(stage)
        if home is not None and home.parent != folder and home.is_dir():
            recover(home.parent)
    try:
        with locked(folder):
            for stage in stages:
                _settle_stage(stage)
    except FileNotFoundError:  # somebody else removed the folder
        return


def _settle_stage(stage: Path) -> None:
    if owner_of(stage) is None:  # empty: cut off before it had its owner
        with suppress(OSError):
            stage.rmdir()
        return
    handle = lock_orphan(stage)
    if handle is None:
        return
    try:
        try:
            journal = read_journal(stage)
            if journal is None:
                remove_stage(stage)
                return
            journal.carry_out()
        except (OSError, ValueError, LookupError, TypeError) as problem:
            reason = getattr(problem, "strerror", None) or type(problem).__name__
            raise InputError("E-FILE-019", _unfinished(stage, reason)) from problem
        for other in journal.stages:
            remove_stage(other)
    finally:
        os.close(handle)


def _unfinished(stage: Path, reason: str) -> str:
    return (
        f"{stage.parent} holds files of a run that was cut off while it replaced those of another, and this cannot be finished ({reason}); "
        "let an account that may write there run any flexcal verb on it."
    )
