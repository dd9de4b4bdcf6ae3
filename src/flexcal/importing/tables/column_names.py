"""Words, numbers and units in column names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from unicodedata import normalize

from flexcal.importing.tables.vocabulary import NEUTRAL, SINGLE

_UNITS = {
    "deg": ("deg", "degree", "degrees", "degs", "°", "º", "grad"),
    "rad": ("rad", "rads", "radian", "radians"),
    "mrad": ("mrad", "milliradian", "milliradians", "mm/m"),
    "turn": ("turn", "turns", "rev"),
    "m": ("m", "meter", "meters", "metre", "metres"),
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres"),
    "um": ("um", "µm", "μm", "micron", "microns"),
    "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres"),
    "in": ("in", "inch", "inches", "zoll", '"', "″", "''"),
    "ft": ("ft", "foot", "feet", "'", "′"),
    "s": ("s", "sec", "second", "seconds"),
    "ms": ("ms", "msec", "millisecond", "milliseconds"),
    "us": ("us", "µs", "μs", "usec"),
    "rad/s": ("rad/s", "rad/sec", "rads^-1"),
    "deg/s": ("deg/s", "°/s", "deg/sec", "grad/s"),
    "rpm": ("rpm", "1/min", "u/min"),
    "m/s": ("m/s",),
    "mm/s": ("mm/s",),
    "rad/s^2": ("rad/s^2", "rad/s²", "rad/s2"),
    "deg/s^2": ("deg/s^2", "deg/s²", "deg/s2", "°/s²", "°/s^2"),
    "m/s^2": ("m/s^2", "m/s²", "m/s2"),
    "mm/s^2": ("mm/s^2", "mm/s²", "mm/s2"),
    "N m": ("nm", "n m", "n*m", "n·m", "newtonmeter"),
    "N": ("n",),
    "A": ("a", "amp", "amps", "ampere"),
    "mA": ("ma",),
    "kg": ("kg",),
    "g": ("g",),
    "degC": ("c", "°c", "degc", "celsius"),
    "degF": ("f", "°f", "degf", "fahrenheit"),
    "K": ("k", "kelvin"),
}
_SPELLINGS = {spelling: unit for unit, spellings in _UNITS.items() for spelling in spellings}
_OTHER_UNITS = ("-", "1", "v", "%", "none", "hz")
_AS_WORD = {
    "deg",
    "degree",
    "degrees",
    "rad",
    "radian",
    "radians",
    "mm",
    "um",
    "cm",
    "inch",
    "inches",
    "ms",
    "us",
    "nm",
    "ma",
    "rpm",
    "kg",
    "celsius",
    "fahrenheit",
    "kelvin",
    "degc",
    "degf",
}
"""Units recognised as the last word of a name."""
_OF_TEMPERATURE = {"c", "f", "k"}
"""Units recognised only after a word of a temperature: elsewhere they are names of axes and others."""
_LAST_WORD = {"m", "s", "a", "n"}
"""Units recognised only after other words, and no number."""
_BRACKETS = re.compile(r"[\[({<]\s*([^\])}>]*?)\s*[\])}>]\s*$")
_MOST_DIGITS = 18
_WORDS = re.compile(r"\d+|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[θφτσω]|[^\W\d_a-zA-Z]+")


@dataclass(frozen=True)
class ColumnName:
    """`column` as it stands in the file, `text` without a unit in brackets; its words in lower case, without numbers and unit; the last
    number in it; the unit.
    """

    column: str
    text: str
    words: tuple[str, ...]
    number: int | None
    unit: str | None


def is_unit(text: str) -> bool:
    """Whether a cell under a header is a unit, in brackets or not."""
    plain = text.strip().strip("[](){}<>").strip().lower()
    return plain in _SPELLINGS or plain in _OTHER_UNITS


def unit_of(text: str) -> str | None:
    """Unit denoted by a text, as `signals:` writes it."""
    return _SPELLINGS.get(text.strip().strip("[](){}<>").strip().lower())


def unknown_unit(column: str) -> str | None:
    """What stands in square brackets at the end of a column's name and is no unit that is known; None where nothing of that kind does."""
    bracket = _BRACKETS.search(column)
    if bracket is None or not bracket[0].startswith("["):
        return None
    text = bracket[1].strip()
    words = {part.lower() for part in _WORDS.findall(text)}
    return None if not text or is_unit(text) or text.isdigit() or words <= NEUTRAL else text


def parse_name(column: str, unit: str | None = None) -> ColumnName:
    """Take a name apart; `unit` is what the file says besides."""
    text, given_unit = column, None if unit is None else unit_of(unit)
    bracket = _BRACKETS.search(column)
    if bracket and not bracket[1].isdigit():
        text, given_unit = column[: bracket.start()], given_unit or unit_of(bracket[1])
    parts = [part.lower() for part in _WORDS.findall(_without_accents(text))]
    if given_unit is None and len(parts) > 1:
        last = parts[-1]
        after_words = len(parts) > 2 or not parts[0].isdigit()
        warm = last in _OF_TEMPERATURE and set(parts[:-1]) & SINGLE["temperature"]
        if warm or last in _AS_WORD or (last in _LAST_WORD and after_words and not _is_short(parts[:-1])):
            given_unit, parts = _SPELLINGS[last], parts[:-1]
    numbers = [int(part) for part in parts if part.isdecimal() and len(part) <= _MOST_DIGITS]
    words = tuple(part for part in parts if not part.isdigit())
    return ColumnName(column, text, words, numbers[-1] if numbers else None, given_unit)


def _without_accents(text: str) -> str:
    """Latin letters without their accents: a column is called Mesuré or Mesure."""
    return "".join(normalize("NFD", c)[0] if c.isalpha() and c < "\u0250" else c for c in text)


def _is_short(parts: list[str]) -> bool:
    return all(len(part) < 2 and part not in ("x", "y", "z", "t") for part in parts)
