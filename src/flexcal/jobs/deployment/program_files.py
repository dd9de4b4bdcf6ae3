"""Files of a robot program: read, and written with other numbers and every other byte kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import atomic_paths
from flexcal.programs import Program, ProgramFile, dialect_of

_ENCODINGS = ("utf-8", "latin-1")
"""Every byte stands for a character in the second, and comes back as it was."""


def read_program(files: Sequence[Path]) -> Program:
    """Program in files of one dialect, and in those that belong to them by their names, as PART.dat to PART.src.

    Raises `InputError` for a file that does not exist or cannot be read, for an unknown suffix, and for files of two dialects.
    """
    dialects = [dialect_of(file) for file in files]
    for file, dialect in zip(files, dialects, strict=True):
        if dialect is not dialects[0]:
            raise InputError(
                "E-PROG-007",
                f"{files[0]} is {dialects[0].name}, {file} is {dialect.name}; give the files of one program.",
            )
    every = with_companions(files)
    return dialects[0].parse([ProgramFile(str(file), _text(file)) for file in every])


def with_companions(files: Sequence[Path]) -> list[Path]:
    """The files, each once, and behind each those beside it that belong to it by the dialect, in any case of letters.

    Raises `InputError` for a file that does not exist, and for an unknown suffix.
    """
    every: list[Path] = []
    for file in files:
        beside = dialect_of(file).beside
        if not file.is_file():
            raise InputError("E-PROG-005", f"{file} does not exist; name the program's file.")
        others = [
            other
            for other in sorted(file.parent.iterdir())
            if other.stem.casefold() == file.stem.casefold()
            and other.suffix.lower() in beside
            and other != file
        ]
        known = {each.resolve() for each in every}
        every += [each for each in (file, *others) if each.resolve() not in known]
    return every


def output_places(files: Sequence[Path], out: Path) -> list[Path]:
    """Where each file of a new program goes: one to `out`, several into the folder `out` under their names.

    Raises `InputError` where `out` is no folder, or would take two files of one name.
    """
    if len(files) == 1:
        return [out]
    names = ", ".join(file.name for file in files)
    if out.is_file() or out.suffix.lower() in {file.suffix.lower() for file in files}:
        raise InputError(
            "E-PROG-008",
            f"--out {out} is one file, but the program has {len(files)}, which keep their names ({names}); give a folder.",
        )
    places = [out / file.name for file in files]
    if len({place.name.casefold() for place in places}) < len(places):
        raise InputError(
            "E-PROG-009",
            f"two of the files have one name ({names}), and cannot go into one folder; rename one.",
        )
    return places


def write_program(files: Sequence[ProgramFile], out: Path) -> list[Path]:
    """Write the files of a program, all or none, and return where; raises `InputError` as `output_places`."""
    sources = [Path(file.name) for file in files]
    places = output_places(sources, out)
    contents = [
        file.text.encode(_encoding(source.read_bytes())) for file, source in zip(files, sources, strict=True)
    ]
    with atomic_paths(*places) as temporaries:
        for temporary, content in zip(temporaries, contents, strict=True):
            temporary.write_bytes(content)
    return places


def _text(file: Path) -> str:
    written = file.read_bytes()
    return written.decode(_encoding(written))


def _encoding(written: bytes) -> str:
    try:
        written.decode(_ENCODINGS[0])
    except UnicodeDecodeError:
        return _ENCODINGS[1]
    return _ENCODINGS[0]
