"""Conversion of time stamps in text form to seconds from the first."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from flexcal.data.tables.tabular_file import Table

STAMP = re.compile(
    r"(?:(?:(?P<year>\d{4})[-/.](?P<month>\d\d?)[-/.](?P<day>\d\d?)"
    r"|(?P<day_first>\d\d?)\.(?P<month_second>\d\d?)\.(?P<year_last>\d{4}))[T ]\s*)?"
    r"(?P<hour>\d\d?):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?)?"
    r"\s*(?P<zone>Z|[-+]\d\d:?\d\d)?"
)
"""Pattern of time stamps: ISO 8601 with a T or a space, 01.03.2026 12:00:00, or a time of day; decimals after a point or a comma."""
_DAY = 86400
_NO_DATE = 1904
"""Latest year that stands for no date, as Excel's for a time of day."""
_DATE = (("year", "year_last"), ("month", "month_second"), ("day", "day_first"))


def seconds_of(texts: Sequence[str]) -> np.ndarray | None:
    """Seconds (N,) from the first of `texts`, NaN for texts that are no time stamp; None if most nonempty ones are none.

    Without dates, a time of day that is half a day or more before the one above it is of the next day.
    """
    stamps = [stamp_of(text) if text else None for text in texts]
    filled = [stamp for stamp in stamps if stamp is not None]
    if not filled or 2 * len(filled) <= sum(bool(text) for text in texts):
        return None
    if len({(dated, zoned) for _, _, dated, zoned in filled}) > 1:
        return None
    first, part, dated, _ = filled[0]
    seconds = np.array([np.nan if s is None else (s[0] - first) + (s[1] - part) for s in stamps])
    if not dated:
        known = np.isfinite(seconds)
        steps = np.diff(seconds[known], prepend=0.0)
        seconds[known] += _DAY * np.cumsum(steps < -_DAY / 2)
    return seconds


def stamp_of(text: str) -> tuple[int, float, bool, bool] | None:
    """Whole seconds, the part of a second after them, and whether there is a date and a time zone; None for any other text."""
    match = STAMP.fullmatch(text.strip())
    if match is None:
        return None
    year, month, day = (match[a] or match[b] for a, b in _DATE)
    hour, minute, second = (int(match[name] or 0) for name in ("hour", "minute", "second"))
    if hour > 23 or minute > 59 or second > 60:
        return None
    dated = bool(year) and int(year) > _NO_DATE
    try:
        days = date(int(year), int(month), int(day)).toordinal() if dated else 0
    except ValueError:
        return None
    zone = match["zone"] or ""
    behind = 0
    if zone not in ("", "Z"):
        digits = zone[1:].replace(":", "")
        behind = (int(digits[:2]) * 60 + int(digits[2:])) * (-60 if zone[0] == "-" else 60)
    whole = days * _DAY + hour * 3600 + minute * 60 + second - behind
    return whole, float(f"0.{match['fraction'] or 0}"), dated, bool(zone)


def with_seconds(tables: Iterable[Table], columns: Collection[str]) -> Iterator[Table]:
    """The tables, which follow each other, with the timestamps of `columns` as seconds from the first.

    Raises `InputError` with row and column for a text that is no timestamp, or differs from the first in having a date or a time zone.
    """
    readers = {column: _Seconds() for column in columns}
    for table in tables:
        seconds = {column: readers[column].of(table, column) for column in columns}
        yield replace(table, columns={**table.columns, **seconds}) if seconds else table


class _Seconds:
    """Seconds from the first timestamp of a column that comes in parts."""

    def __init__(self) -> None:
        self._first: tuple[int, float, bool, bool] | None = None
        self._last, self._days = 0.0, 0

    def of(self, table: Table, column: str) -> np.ndarray:
        """Seconds of the next part (N,)."""
        seconds = np.zeros(len(table))
        for row, text in enumerate(table.columns[column].tolist()):
            stamp = stamp_of(text)
            first = self._first = self._first or stamp
            if stamp is None or first is None or stamp[2:] != first[2:]:
                like = (
                    "" if stamp is None or first is None else " with date and time zone as in the first row"
                )
                raise table.error(
                    "E-TABLE-040",
                    row,
                    column,
                    f"'{text}' is no time{like}; write it as 2026-03-01T12:00:00.123.",
                )
            since = (stamp[0] - first[0]) + (stamp[1] - first[1])
            if not first[2] and since - self._last < -_DAY / 2:
                self._days += 1
            self._last = since
            seconds[row] = since + _DAY * self._days
        return seconds
