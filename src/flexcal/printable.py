"""Text that is safe to print, to write as one line, and to give to a shell: names from files can hold anything."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TextIO

LONGEST_SENTENCE = 1000
_LONGEST_EXCERPT = 40
_BREAKS = r"\u2028\u2029"
_DIRECTIONS = r"\u202a-\u202e\u2066-\u2069"
_UNSAFE = re.compile(rf"[\x00-\x08\x0b-\x1f\x7f-\x9f{_BREAKS}{_DIRECTIONS}]")
_NOT_IN_A_NAME = re.compile(rf"[\x00-\x1f\x7f-\x9f{_BREAKS}{_DIRECTIONS}]")


def printable(text: str) -> str:
    """`text` with control characters and marks of the writing direction written out (`\\x1b`), tabs and line ends kept."""
    return _UNSAFE.sub(_written_out, text)


def sentence(problem: object) -> str:
    """What a problem says, on one printable line; beyond `LONGEST_SENTENCE` letters its middle is left out."""
    text = one_line(str(problem))
    if len(text) <= LONGEST_SENTENCE:
        return text
    return f"{text[: LONGEST_SENTENCE - 300]} … {text[-290:]}"


def one_line(text: str) -> str:
    """`text` on one printable line."""
    return printable(" ".join(text.split()))


def excerpt(text: str) -> str:
    """The beginning of a text from a file, as a message quotes it."""
    line = one_line(text[: 2 * _LONGEST_EXCERPT])
    return (
        line
        if len(line) <= _LONGEST_EXCERPT and len(text) <= 2 * _LONGEST_EXCERPT
        else f"{line[: _LONGEST_EXCERPT - 1]}…"
    )


def name_fault(name: str) -> str:
    """The first character that no name of a link, joint or point may hold, written out; empty where there is none.

    Names stand in lines of text files and in XML, which control characters and line ends would break.
    """
    found = _NOT_IN_A_NAME.search(name)
    return _written_out(found) if found else ""


def quoted(path: str | Path) -> str:
    """`path` as one word of a command line, for a command that the user is to copy."""
    text = str(path)
    return shlex.quote(f"./{text}" if text.startswith("-") else text)


def _written_out(match: re.Match[str]) -> str:
    return ascii(match.group())[1:-1]


_REDIRECTING = Lock()
_MOST_QUOTED = 100_000
"""Bytes of messages that are looked at."""


def _is_standard_error(stream: TextIO | None) -> bool:
    try:
        return stream is not None and stream.fileno() == 2
    except (OSError, ValueError):
        return False


@contextmanager
def printable_errors(library: str) -> Iterator[None]:
    """What C or C++ writes to standard error in the block stands there on one printable line after the name of the `library`.

    Parsers quote names, which can hold anything. What other threads print from Python meanwhile goes to standard error as it is.
    """
    import io
    import tempfile

    with _REDIRECTING, tempfile.TemporaryFile() as written:
        stderr, python = os.dup(2), sys.stderr
        if _is_standard_error(python):
            direct = io.FileIO(stderr, "w", closefd=False)
            sys.stderr = io.TextIOWrapper(direct, errors="backslashreplace", write_through=True)
        os.dup2(written.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            sys.stderr = python
            os.close(stderr)
            written.seek(0)
            if told := sentence(written.read(_MOST_QUOTED).decode("utf-8", "replace")):
                print(f"{library}: {told}", file=sys.stderr)
