"""The command line of this run, stored for reproduction."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextvars import ContextVar
from pathlib import Path

_GIVEN: ContextVar[str] = ContextVar("command_line", default="")


def record_command_line(arguments: Sequence[str]) -> None:
    """Note the arguments after `flexcal`."""
    _GIVEN.set(shlex.join(["flexcal", *(_from_here(text) for text in arguments)]))


def command_line(*, without: str = "") -> str:
    """The command line, paths in or under the current folder relative to it; `without` an option and its one value."""
    if not without:
        return _GIVEN.get()
    words, kept = iter(shlex.split(_GIVEN.get())), []
    for word in words:
        if word == without:
            next(words, None)
        elif not word.startswith(f"{without}="):
            kept.append(word)
    return shlex.join(kept)


def _from_here(argument: str) -> str:
    path = Path(argument)
    try:
        here = Path.cwd()
    except OSError:  # it has been removed
        return argument
    return str(path.relative_to(here)) if path.is_absolute() and path.is_relative_to(here) else argument
