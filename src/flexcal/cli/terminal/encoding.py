"""Replacement of letters that a terminal cannot show."""

from __future__ import annotations

import codecs
import sys
import unicodedata
from io import TextIOWrapper

_NEAR = {"…": "...", "·": "*", "–": "-", "−": "-", "σ": "sigma", "χ": "chi", "°": " deg", "µ": "u", "×": "x"}
_NEAR |= dict.fromkeys("─━═╌╍", "-") | dict.fromkeys("│┃║", "|")


def substitute_unencodable() -> None:
    """Let standard output and error show near letters where their encoding lacks one."""
    codecs.register_error("flexcal.near", _near)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="flexcal.near")


def _near(problem: UnicodeError) -> tuple[str, int]:
    if not isinstance(problem, UnicodeEncodeError):
        raise problem
    return "".join(map(_letter, problem.object[problem.start : problem.end])), problem.end


def _letter(letter: str) -> str:
    if letter in _NEAR:
        return _NEAR[letter]
    if unicodedata.name(letter, "").startswith("BOX DRAWINGS"):
        return "+"
    plain = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
    return plain or "?"
