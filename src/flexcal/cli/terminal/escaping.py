"""Text that is safe to print: names from files can hold escape sequences, with which a terminal would act."""

from __future__ import annotations

import re

LONGEST_SENTENCE = 1000
_UNSAFE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    """`text` with control characters and marks of the writing direction written out (`\\x1b`), tabs and line ends kept."""
    return _UNSAFE.sub(lambda match: ascii(match.group())[1:-1], text)


def sentence(problem: object) -> str:
    """What a problem says, on one printable line; beyond `LONGEST_SENTENCE` letters its middle is left out."""
    text = printable(" ".join(str(problem).split()))
    if len(text) <= LONGEST_SENTENCE:
        return text
    return f"{text[: LONGEST_SENTENCE - 300]} … {text[-290:]}"
