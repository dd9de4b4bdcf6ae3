"""What may lie between someone's files and is not theirs to act: hostile names, links, pipes, and left-overs of runs that were cut off."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable
from pathlib import Path

HOSTILE_NAMES = (
    *(
        "a\nb",
        "\x1b[31mred\x1b]0;t\x07",
        "a b",
        "k\udce4se",
        "\udcff\udcfe",
        "a\u2028b",
        "a\x85b",
        "[red]x [bold]",
    ),
    *(
        "a'\"b <script>",
        "ζ ☃",
        "{0} %s $HOME",
        "--out",
        "-rf",
        "$(touch pwned)",
        "`id`",
        "..a",
        "*",
        "x" * 200,
    ),
)
_JOURNAL = {
    "changes": [["1.sh", "../../home/.bash_profile", None], ["1.sh", "../home/.bash_profile", None]],
    "stages": ["../home/docs", "../../home/docs", "."],
}


def _socket(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # the path of a socket has at most 107 letters
    try:
        with socket.socket(socket.AF_UNIX) as opened:
            opened.bind(path.name)
    finally:
        os.chdir(here)


def _sparse(path: Path) -> None:
    path.touch()
    os.truncate(path, 10 * 10**9)


def _link(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


KINDS: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "socket": _socket,
    "zeros": _link("/dev/zero"),
    "terminal": _link("/dev/tty"),
    "folder": Path.mkdir,
    "dangling": _link("nothing"),
    "loop": lambda path: path.symlink_to(path.name),
    "sparse": _sparse,
    "secret": lambda path: path.symlink_to(home_of(path) / "secret"),
    "missing": lambda path: None,
}
"""What may be in the place of a file, and how it is made."""


def home_of(path: Path) -> Path:
    """The folder outside that nothing may touch."""
    return next(above / "home" for above in path.parents if (above / "home").is_dir())


def _cut_off_run(folder: Path, journal: str | None, name: str = "x") -> None:
    """A left-over of a run that was killed, whose journal someone wrote."""
    stage = folder / f".flexcal-run-{name}"
    stage.mkdir(parents=True)
    (stage / "owner").write_text("calibrate\n1\n*")
    (stage / "1.sh").write_text("echo owned\n")
    if journal is not None:
        (stage / "journal.json").write_text(journal)


def _pipes_of_a_run(folder: Path) -> None:
    stage = folder / ".flexcal-run-pipes"
    stage.mkdir(parents=True)
    for name in ("journal.json", "primary", "owner"):
        os.mkfifo(stage / name)


def _runs_that_name_each_other(folder: Path) -> None:
    for one, other in (("a", "b"), ("b", "a")):
        _cut_off_run(folder, json.dumps({"changes": [], "stages": [f".flexcal-run-{other}"]}), one)
        (folder / f".flexcal-run-{one}" / "primary").write_text(f"../.flexcal-run-{other}")


def _hostile_names(folder: Path) -> None:
    for name in HOSTILE_NAMES:
        for ending in ("", ".csv", ".yaml"):
            if not (folder / f"{name}{ending}").is_dir():  # as what was read before may be
                (folder / f"{name}{ending}").write_text("1,2\n")


def _links(folder: Path) -> None:
    home = home_of(folder / "x")
    for name, target in {
        "to_file": home / ".bash_profile",
        "to_folder": home / "docs",
        "dangling.csv": home / "nothing",
        "loop": "loop",
        "here": ".",
        "above": "..",
        "zeros.csv": "/dev/zero",
        "terminal.yaml": "/dev/tty",
    }.items():
        (folder / name).symlink_to(target)


def _linked_outputs(folder: Path) -> None:
    """Links under the names that verbs write."""
    home = home_of(folder / "x")
    for name in (
        "results.json",
        "report.html",
        "estimates.yaml",
        "new.html",
        "plan.yaml",
        "robot.yaml",
        "arm.urdf",
    ):
        if not os.path.lexists(folder / name):
            (folder / name).symlink_to(home / (".bash_profile" if name < "p" else "nothing"))
    (folder / "new.csv").symlink_to(home / "secret")


def _pipes(folder: Path) -> None:
    for name in (
        "primary",
        "pipe.csv",
        "pipe.yaml",
        ".studio.json",
        "pipe.png",
        "pipe.parquet",
        "estimates.yaml.tmp",
    ):
        os.mkfifo(folder / name)


def _temporary_files(folder: Path) -> None:
    for name in (
        ".robot.yaml.tmp",
        ".estimates.yaml.x1y2",
        ".flexcal-x1y2z3",
        ".new.lock",
        ".flexcal.lock",
        ".~lock.poses.csv#",
    ):
        (folder / name).write_text("torn")
    (folder / ".flexcal-old").mkdir()
    (folder / ".flexcal-old/results.json").write_text("{}")


def _ledger(folder: Path) -> None:
    """A record of files in a folder that names such as lie elsewhere."""
    if not (folder / ".flexcal").exists():
        (folder / ".flexcal").write_text(
            json.dumps(
                {
                    "../home/secret": ["0" * 64, "calibrate"],
                    "/etc/passwd": ["", "calibrate"],
                    "notes.txt": ["", ""],
                }
            )
        )


def _notes(folder: Path) -> None:
    for name in ("notes.txt", "estimates.npz.bak", "points2.csv"):
        (folder / name).write_text("mine")


INTRUSIONS: dict[str, Callable[[Path], None]] = {
    "names": _hostile_names,
    "links": _links,
    "linked_outputs": _linked_outputs,
    "pipes": _pipes,
    "temporary": _temporary_files,
    "ledger": _ledger,
    "notes": _notes,
    "cut_off": lambda folder: _cut_off_run(folder, json.dumps(_JOURNAL)),
    "cut_off_deep": lambda folder: _cut_off_run(folder, "[" * 200_000, "deep"),
    "cut_off_empty": lambda folder: _cut_off_run(folder, None, "none"),
    "cut_off_pipes": _pipes_of_a_run,
    "cut_off_circle": _runs_that_name_each_other,
}
"""How each is made in a folder."""


def write_home(folder: Path) -> None:
    """What has to stay as it is: a profile, a secret and documents."""
    (folder / "docs").mkdir(parents=True)
    (folder / "docs/letter.txt").write_text("dear\n")
    (folder / ".bash_profile").write_text("export A=1\n")
    (folder / "secret").write_text("canary-7f3a\n")
