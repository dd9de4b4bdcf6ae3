"""Sizes of a Parquet file's columns once they are decoded, from its footer and the headers of its pages alone."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import Any

from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, open_regular, size_text, unpacked_limit

LARGEST_DECODED = 1000 * MEGABYTE
"""Bytes of decoded values that are in memory together: of a whole table, and of a row group of one that is read as a stream."""
_LARGEST_FOOTER = 16 * MEGABYTE
_WIDTH = 16
"""Bytes of a decoded value: 8 of a number, 16 of a text's place among the decoded pages."""
_LONGEST_HEADER = 2**14
"""Bytes that hold the header of a page, with statistics."""
_MOST_PAGES = 100_000
_DEEPEST = 20
_END = b"PAR1"


def require_decodable(path: str | Path, columns: Collection[str] | None = None, *, stream: bool) -> None:
    """Raise `InputError` for a file whose `columns` (None: all), of a `stream` those of a row group, exceed `LARGEST_DECODED`.

    So does what is no Parquet file. A small file may be of any size: equal values, and pages of zeros, take hardly any place in it.
    """
    try:
        with open_regular(path, limit=None) as file:
            limit = unpacked_limit(os.fstat(file.fileno()).st_size, LARGEST_DECODED)
            sizes = [sum(group) for group in _row_groups(file, columns)]
    except OSError as problem:
        raise unreadable(Path(path), problem) from problem
    except (ValueError, LookupError, TypeError, OverflowError) as problem:
        raise InputError(
            "E-TABLE-046", f"{path}: not a readable Parquet file (damaged headers); export it again."
        ) from problem
    size = max(sizes, default=0) if stream else sum(sizes)
    if size > limit:
        what = "a row group of it" if stream else "it"
        raise InputError(
            "E-TABLE-047",
            f"{path}: {what} has {size_text(size)} when it is decoded, and such a table is read up to {size_text(limit)}; "
            "check that it is the right one, or export fewer rows at a time.",
        )


def _row_groups(file: BufferedReader, columns: Collection[str] | None) -> Iterator[list[int]]:
    """Decoded sizes of the columns of each row group: of their values, and of the pages from which these come."""
    end = file.seek(0, os.SEEK_END)
    file.seek(max(0, end - 8))
    length = int.from_bytes(file.read(4), "little")
    if file.read(4) != _END or not length <= min(end - 8, _LARGEST_FOOTER):
        raise ValueError
    file.seek(end - 8 - length)
    footer = _struct(BytesIO(file.read(length)))
    pages = 0
    for group in footer.get(4, []):
        sizes = []
        for chunk in group[1]:
            about = chunk[3]
            if columns is not None and about[3][0].decode("utf-8", "replace") not in columns:
                continue
            values, size = max(about[5], group[3]), 0
            place = min(about[9], about.get(11) or about[9])
            chunk_end = place + about[7]
            while place < chunk_end:
                pages += 1
                if pages > _MOST_PAGES:
                    raise ValueError
                file.seek(place)
                header = BytesIO(file.read(_LONGEST_HEADER))
                page = _struct(header)
                if min(page[2], page[3]) < 0:
                    raise ValueError
                size += page[2]
                place += header.tell() + page[3]
            sizes.append(values * _WIDTH + size)
        yield sizes


def _struct(stream: BytesIO, depth: int = 0) -> dict[int, Any]:
    """Fields, by their numbers, of a struct in Thrift's compact protocol."""
    if depth > _DEEPEST:
        raise ValueError
    fields: dict[int, Any] = {}
    number = 0
    while head := _byte(stream):
        number = number + (head >> 4) if head >> 4 else _signed(stream)
        fields[number] = head & 15 == 1 if head & 15 in (1, 2) else _value(stream, head & 15, depth)
    return fields


def _value(stream: BytesIO, kind: int, depth: int) -> Any:
    if kind in (1, 2, 3):
        return _byte(stream)
    if kind in (4, 5, 6):
        return _signed(stream)
    if kind in (7, 8):
        return stream.read(8 if kind == 7 else _varint(stream))
    if kind in (9, 10):
        head = _byte(stream)
        count = _varint(stream) if head >> 4 == 15 else head >> 4
        return [_value(stream, head & 15, depth + 1) for _ in range(count)]
    if kind == 12:
        return _struct(stream, depth + 1)
    raise ValueError


def _byte(stream: BytesIO) -> int:
    return stream.read(1)[0]


def _signed(stream: BytesIO) -> int:
    value = _varint(stream)
    return (value >> 1) ^ -(value & 1)


def _varint(stream: BytesIO) -> int:
    """Whole number of up to 64 bits, 7 a byte."""
    value = 0
    for shift in range(0, 64, 7):
        byte = _byte(stream)
        value |= (byte & 127) << shift
        if byte < 128:
            return value
    raise ValueError
