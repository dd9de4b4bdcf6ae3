"""Standard streams that are closed, or whose reader has gone."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from typing import TextIO

from flexcal.errors import FlexcalError


def replace_closed_streams() -> None:
    """Let what goes to a closed standard stream be lost, rather than end up in the next file that is opened."""
    for handle in range(3):
        try:
            os.fstat(handle)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


@contextmanager
def buffered_output() -> Iterator[None]:
    """Standard output appears when the block ends, also by an exception: results are shown once their files are in place.

    Messages that standard error does not take are lost. Raises `FlexcalError` where standard output cannot be written; that its reader has
    gone is no error.
    """
    shown, buffer = sys.stdout, _HeldOutput(sys.stdout)
    try:
        with redirect_stdout(buffer), redirect_stderr(_Forgiving(sys.stderr)):
            yield
    except BaseException:
        _show(shown, buffer)
        raise
    problem = _show(shown, buffer)
    if problem is not None and not isinstance(problem, BrokenPipeError):
        reason = problem.strerror or str(problem)
        raise FlexcalError(
            "E-CLI-019", f"standard output cannot be written ({reason}); the files of this run are in place."
        ) from problem


def _show(stream: TextIO, buffer: _HeldOutput) -> OSError | None:
    """Write what was held; what stands in the way of it, None where nothing does."""
    try:
        stream.write(buffer.text())
        stream.flush()
    except OSError as problem:
        # nothing more can be said there, not even at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return problem
    return None


class _Stream(io.TextIOBase):
    """A stream that tells of another what programs ask before they write to it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    @property
    def encoding(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] (typeshed has an attribute)
        return self._stream.encoding

    @property
    def errors(self) -> str | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self._stream.errors

    def isatty(self) -> bool:
        return self._stream.isatty()

    def fileno(self) -> int:
        return self._stream.fileno()

    def writable(self) -> bool:
        return True


class _HeldOutput(_Stream):
    def __init__(self, stream: TextIO) -> None:
        super().__init__(stream)
        self._parts: list[str] = []

    def write(self, text: str) -> int:
        self._parts.append(text)
        return len(text)

    def text(self) -> str:
        return "".join(self._parts)


class _Forgiving(_Stream):
    def write(self, text: str) -> int:
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            self._stream.flush()
