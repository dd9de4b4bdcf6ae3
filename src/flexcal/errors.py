"""The errors that flexcal raises on purpose."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class FlexcalError(Exception):
    """An error that the user can correct: its text is one sentence that says what is wrong, where, and what to do.

    Parameters
    ----------
    code : str
        Code of the sentence, as in `E-URDF-017`, whatever file, joint or number stands in it. Every error has its own, the
        documentation lists them, and none is used again for another. An error that is raised in place of another, to say
        where, keeps the code of that.
    sentence : str
        What is wrong, where, and what to do.
    """

    code: str

    def __init__(self, code: str, sentence: str):
        super().__init__(code, sentence)  # pickle makes the error again from these
        self.code = code
        self.sentence = sentence

    def __str__(self) -> str:
        return self.sentence


class InputError(FlexcalError):
    """A file or argument that cannot be used as it is; the message names the file, and line, column or joint where there is one.

    Parameters
    ----------
    code, sentence : str
        As those of `FlexcalError`.
    """


def unreadable(path: Path, problem: Exception, remedy: str = "check the name and the folder") -> InputError:
    """Error of a file that cannot be read, with the system's reason on one line, and what to do."""
    reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
    return InputError("E-FILE-001", f"{path} cannot be read ({reason}); {remedy}.")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Within it, an error about what a file holds names that file; an `InputError` already does."""
    try:
        yield
    except InputError:
        raise
    except FlexcalError as problem:
        raise InputError(problem.code, f"{path}: {problem}") from problem
