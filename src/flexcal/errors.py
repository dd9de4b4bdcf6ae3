"""The errors that flexcal raises on purpose."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class FlexcalError(Exception):
    """An error that the user can correct; the message is one sentence that says what is wrong, where, and what to do."""


class InputError(FlexcalError):
    """A file or argument that cannot be used as it is; the message names the file, and line, column or joint where there is one."""


def unreadable(path: Path, problem: Exception, remedy: str = "check the name and the folder") -> InputError:
    """The error of a file that cannot be read, with the system's reason on one line, and what to do."""
    reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
    return InputError(f"{path} cannot be read ({reason}); {remedy}.")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Within it, an error about what a file holds names that file; an `InputError` already does."""
    try:
        yield
    except InputError:
        raise
    except FlexcalError as problem:
        raise InputError(f"{path}: {problem}") from problem
