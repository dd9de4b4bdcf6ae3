"""Pipes, sockets, devices and folders in the place of files."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

from fuzz_cases import Case, names_of
from fuzz_process import Ending, FlexcalProcesses


def _socket(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # the path of a socket has at most 107 letters
    try:
        with socket.socket(socket.AF_UNIX) as opened:
            opened.bind(path.name)
    finally:
        os.chdir(here)


KINDS: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "socket": _socket,
    "zeros": lambda path: path.symlink_to("/dev/zero"),
    "folder": Path.mkdir,
}
"""How each is made."""
_OPTIONAL = ("results/.flexcal", "results/gravity_loads.npz", "responses/plan.yaml")
"""Files without which the verbs do other work."""


def ended(
    flexcal: FlexcalProcesses, kind: str, file: str, line: str, seeds: Path, folder: Path
) -> tuple[Ending, str | None]:
    """How a command line ends that finds one of `KINDS` in the place of a file, and what is wrong with that."""
    shutil.copytree(seeds, folder)
    (folder / file).unlink()
    KINDS[kind](folder / file)
    case = Case(kind, file, b"", tuple(line.split()))
    ending = flexcal.run(case.arguments, folder)
    left = sorted(path.name for path in folder.glob("new*"))
    shutil.rmtree(folder)
    problem = ending.fault(names_of(case))
    if ending.status == 0 and file not in _OPTIONAL:
        problem = "goes on"
    elif ending.status and left:
        problem = f"leaves {left}"
    return ending, problem and f"{kind} as {file}, flexcal {line}: {problem}"
