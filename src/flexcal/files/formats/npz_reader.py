"""Checked reading of `.npz` files: every array is there, of the kind and shape that is expected, and finite."""

from __future__ import annotations

import warnings
import zipfile
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal

import numpy as np
from numpy.lib.npyio import NpzFile as NpzArrays

from flexcal.errors import InputError
from flexcal.files.transaction import MEGABYTE, current_path, open_regular, size_text, unpacked_limit
from flexcal.units import LARGEST

Kind = Literal["real", "complex", "whole", "truth", "text"]
_KINDS: dict[Kind, tuple[str, str]] = {
    "real": ("fiu", "numbers"),
    "complex": ("cfiu", "complex numbers"),
    "whole": ("iu", "whole numbers"),
    "truth": ("b", "truth values"),
    "text": ("U", "texts"),
}

_LARGEST = 1000 * MEGABYTE
_LARGEST_READ = 500 * MEGABYTE
"""Bytes of the arrays that are read together, once they are unpacked."""


@dataclass(frozen=True)
class ArrayForm:
    """Expected form of an array: its kind, and per axis an extent or a name; axes of one name have equal length in all arrays of a file.

    Numbers that are not finite are refused unless `finite` is False; so are numbers beyond `units.LARGEST`.
    """

    kind: Kind
    axes: tuple[str | int, ...] = ()
    finite: bool = True


class NpzFile:
    """The arrays of an .npz file, read and checked one by one; `remedy` ends the sentences of its errors, as in 'run … again'.

    Opening and reading raise `InputError` that names the file and the array, for whatever is not as expected. Nothing is unpickled.
    """

    def __init__(self, path: Path, remedy: str):
        self.path, self.remedy = path, remedy
        self._lengths: dict[str, int] = {}
        self._names: frozenset[str] = frozenset()
        with self._opened() as stored:
            self._names = frozenset(stored.files)

    def __contains__(self, name: str) -> bool:
        return name in self._names

    @property
    def names(self) -> frozenset[str]:
        """The names of the arrays."""
        return self._names

    def error(self, code: str, sentence: str) -> InputError:
        """An `InputError` about this file."""
        return InputError(code, f"{self.path} {sentence}; {self.remedy}.")

    def read(self, forms: Mapping[str, ArrayForm]) -> dict[str, np.ndarray]:
        """The arrays of these names and forms."""
        with self._opened() as stored:
            size = sum(self._checked_form(stored, name, form) for name, form in forms.items())
            packed = (
                0 if stored.zip is None else sum(member.compress_size for member in stored.zip.infolist())
            )
            limit = unpacked_limit(packed, _LARGEST_READ)
            if size > limit:
                raise self.error(
                    "E-FILE-026",
                    f"holds arrays of {size_text(size)}, and such a file is read up to {size_text(limit)}",
                )
            return {name: self._checked(name, stored[name], form) for name, form in forms.items()}

    @contextmanager
    def _opened(self) -> Iterator[NpzArrays]:
        try:
            with open_regular(self.path, limit=_LARGEST) as stream:
                if not zipfile.is_zipfile(stream):
                    stream.seek(0)
                    _header(stream)
                    raise self.error("E-FILE-002", "is no .npz file")
                stream.seek(0)
                with np.load(stream, allow_pickle=False) as stored:
                    yield stored
        except InputError:
            raise
        except Exception as problem:  # whatever NumPy, zipfile and tokenize raise for a broken file
            told = isinstance(problem, OSError) and problem.strerror
            raise self.error("E-FILE-003", f"cannot be read ({told or type(problem).__name__})") from problem

    def _checked_form(self, stored: NpzArrays, name: str, form: ArrayForm) -> int:
        """Bytes of an array whose kind and shape, by its header, are those of `form`."""
        if name not in stored.files:
            raise self.error("E-FILE-004", f"lacks the array '{name}'")
        archive = stored.zip
        assert archive is not None  # it is open
        member = archive.getinfo(f"{name}.npy" if f"{name}.npy" in archive.namelist() else name)
        with archive.open(member) as stream:
            shape, dtype = _header(stream)
            count = 1
            for extent in shape:
                count *= extent
            if dtype.hasobject or min(shape, default=0) < 0 or count * dtype.itemsize > member.file_size:
                raise self.error("E-FILE-005", f"holds no array of numbers or texts as '{name}'")
        kinds, what = _KINDS[form.kind]
        if dtype.kind not in kinds:
            raise self.error("E-FILE-006", f"holds {dtype} as '{name}', not {what}")
        extents = [self._lengths.get(axis) if isinstance(axis, str) else axis for axis in form.axes]
        fits = len(shape) == len(extents) and all(
            extent in (None, length) for extent, length in zip(extents, shape, strict=True)
        )
        if not fits:
            raise self.error(
                "E-FILE-007", f"holds '{name}' with the shape {shape}, which does not fit the rest"
            )
        for axis, length in zip(form.axes, shape, strict=True):
            if isinstance(axis, str):
                self._lengths[axis] = length
        return count * dtype.itemsize

    def _checked(self, name: str, array: np.ndarray, form: ArrayForm) -> np.ndarray:
        if form.kind in ("real", "complex"):
            with np.errstate(over="ignore"):
                size = np.abs(array)
            if form.finite and not np.isfinite(size).all():
                raise self.error("E-FILE-008", f"holds numbers in '{name}' that are not finite")
            if float(np.max(size, initial=0.0, where=np.isfinite(size))) > LARGEST:
                raise self.error("E-FILE-009", f"holds numbers beyond {LARGEST:g} in '{name}'")
        return array


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type of the array that a stream in NumPy's format begins with; raises `ValueError` where it does not."""
    first = np.lib.format.read_magic(stream) == (1, 0)
    read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy's, of headers as Python 2 wrote them
        shape, _, dtype = read(stream)
    return shape, dtype


def refuse_foreign(path: Path, ours: Set[str]) -> None:
    """Raise `InputError` for a file that holds anything but arrays of the names `ours`: it was not written by flexcal."""
    if not current_path(path).exists():
        return
    try:
        foreign = NpzFile(path, "").names - ours
    except InputError:
        foreign = {"no arrays"}
    if foreign:
        raise InputError(
            "E-FILE-010",
            f"{path} was not written by flexcal (it holds {min(foreign)}), and such a file is never changed; move it away.",
        )
