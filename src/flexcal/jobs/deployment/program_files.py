"""Files of a robot program: read, and written with other numbers and every other byte kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.errors import InputError, naming
from flexcal.files.transaction import MEGABYTE, atomic_paths, read_bytes, real_path
from flexcal.programs import Program, ProgramFile, dialect_of

_LARGEST = 16 * MEGABYTE
_ENCODINGS = ("utf-8", "latin-1")
"""Every byte stands for a character in the second, and comes back as it was."""


def read_program(*paths: str | Path) -> Program:
    """Read a robot program.

    Parameters
    ----------
    paths : str or Path
        Its files, of one dialect. Files that belong to them by their names, as PART.dat to PART.src, are read too.

    Returns
    -------
    Program
        `targets` that are written as numbers, and those `computed` when the program runs.

    Raises
    ------
    InputError
        For a file that does not exist or cannot be read, for an unknown suffix, and for files of two dialects.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from flexcal import read_program
    >>> file = Path(tempfile.mkdtemp()) / "a.script"
    >>> _ = file.write_text("movej([-0.4, -1.2, 1.9, -2.2, -1.5, 0.2])\\nmovel(pose_add(a, b))")
    >>> program = read_program(file)
    >>> program.targets[0].values, program.computed[0].text
    ((-0.4, -1.2, 1.9, -2.2, -1.5, 0.2), 'movel(pose_add(a, b))')
    """
    files = [Path(path) for path in paths]
    dialects = [dialect_of(file) for file in files]
    for file, dialect in zip(files, dialects, strict=True):
        if dialect is not dialects[0]:
            raise InputError(
                "E-PROG-007",
                f"{files[0]} is {dialects[0].name}, {file} is {dialect.name}; give the files of one program.",
            )
    every = with_companions(files)
    with naming(files[0]):
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
        known = {real_path(each) for each in every}
        every += [each for each in (file, *others) if real_path(each) not in known]
    return every


def written_files(files: Sequence[Path]) -> list[Path]:
    """Those of the files, and of those that belong to them, that the new program has; tables of frames are only read.

    Raises `InputError` as `with_companions`, and where none is left.
    """
    every = with_companions(files)
    kept = [file for file in every if file.suffix.lower() not in dialect_of(file).tables]
    if not kept:
        raise InputError(
            "E-PROG-015", f"{every[0]} holds frames and tools, no program; name the program's file before it."
        )
    return kept


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


def write_program(program: Sequence[ProgramFile], out: Path) -> list[Path]:
    """Write the files of a program, all or none, and return where; raises `InputError` as `output_places`."""
    sources = written_files([Path(file.name) for file in program])
    files = [file for file in program if Path(file.name) in sources]
    places = output_places(sources, out)
    contents = [
        file.text.encode(_encoding(read_bytes(source, limit=_LARGEST)))
        for file, source in zip(files, sources, strict=True)
    ]
    with atomic_paths(*places) as temporaries:
        for temporary, content in zip(temporaries, contents, strict=True):
            temporary.write_bytes(content)
    return places


def _text(file: Path) -> str:
    written = read_bytes(file, limit=_LARGEST)
    return written.decode(_encoding(written))


def _encoding(written: bytes) -> str:
    try:
        written.decode(_ENCODINGS[0])
    except UnicodeDecodeError:
        return _ENCODINGS[1]
    return _ENCODINGS[0]
