"""Files of one run take their places together, wherever the run is killed.

Processes that are to be killed are forked, some thousand of them, by one that has little memory to copy.
"""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import refused

from flexcal.files.transaction import FileTransaction, Stage, atomic_path, current_path, recover, write_text
from flexcal.files.transaction.staging_folder import PREFIX

STEPS = {
    "os.rename",
    "os.remove",
    "os.rmdir",
    "os.mkdir",
    "open",
    "os.truncate",
    "shutil.rmtree",
    "os.chmod",
    "os.listdir",
    "os.scandir",
}
"""Audit events of what touches files."""


def in_child(action: Callable[[], None]) -> int:
    """The wait status of a process that does it."""
    child = os.fork()
    if child == 0:
        try:
            action()
        finally:
            os._exit(0)
    return os.waitpid(child, 0)[1]


def killed_at(step: int, action: Callable[[], None]) -> bool:
    """Whether a process that does it is killed, without warning, before it touches files for this time."""

    def act() -> None:
        left = step

        def watch(event: str, _arguments: object) -> None:
            nonlocal left
            if event in STEPS:
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(watch)
        action()

    return os.WIFSIGNALED(in_child(act))


def in_small_process(action: Callable[[Path], None], folder: Path) -> None:
    """Do it in a process that has imported little."""
    command = [sys.executable, __file__, action.__name__, str(folder)]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parent)},
    )
    assert done.returncode == 0, done.stderr


def whole(folder: Path) -> str:
    """Which run the files of a folder are of; fails where they are of several, or something else is left."""
    names = sorted(os.listdir(folder))
    texts = {(folder / name).read_text() for name in names if name != "mine"}
    assert len(texts) == 1 and (folder / "mine").read_text() == "mine"
    (text,) = texts
    assert names == (["a", "b", "mine", "old"] if text == "old" else ["a", "b", "mine", "new"])
    return text


def write_run(folder: Path, text: str) -> None:
    """Three files, one of which the other run does not write."""
    with FileTransaction() as run:
        for name in ("a", text, "b"):
            write_text(folder / name, text)
        gone = folder / ("old" if text == "new" else "new")
        if gone.exists():
            run.remove(gone)


def test_killed_at_any_step(tmp_path: Path) -> None:
    """A reader that opens the folder finds one run; so does the next run, which works."""
    in_small_process(kill_at_any_step, tmp_path)


def kill_at_any_step(tmp_path: Path) -> None:
    ended = {"old": 0, "new": 0}
    for step in range(400):
        folder = tmp_path / str(step)
        folder.mkdir()
        (folder / "mine").write_text("mine")
        write_run(folder, "old")
        if not killed_at(step, lambda folder=folder: write_run(folder, "new")):
            break
        recover(folder)
        ended[whole(folder)] += 1
        write_run(folder, "new")
        assert whole(folder) == "new"
    else:
        raise AssertionError("the run never ended")
    assert ended["old"] > 10 and ended["new"] > 5


def test_killed_while_the_rest_is_finished(tmp_path: Path) -> None:
    """What is finished after a kill may be killed too."""
    in_small_process(kill_while_the_rest_is_finished, tmp_path)


def kill_while_the_rest_is_finished(tmp_path: Path) -> None:
    for step in range(20, 200):
        folder = tmp_path / str(step)
        folder.mkdir()
        (folder / "mine").write_text("mine")
        write_run(folder, "old")
        if not killed_at(step, lambda folder=folder: write_run(folder, "new")):
            break
        for again in range(100):
            if not killed_at(again, lambda folder=folder: recover(folder)):
                break
        recover(folder)
        whole(folder)


def test_two_folders_change_together(tmp_path: Path) -> None:
    in_small_process(kill_between_two_folders, tmp_path)


def kill_between_two_folders(tmp_path: Path) -> None:
    def write(text: str) -> None:
        with FileTransaction():
            for folder in ("one", "two"):
                write_text(tmp_path / folder / "a", text)

    seen = set()
    write("0")
    for step in range(400):
        before = (tmp_path / "one" / "a").read_text()
        if not killed_at(step, lambda step=step: write(str(step + 1))):
            break
        first, second = ("one", "two") if step % 2 else ("two", "one")
        recover(tmp_path / first)
        text = (tmp_path / first / "a").read_text()
        assert text in (before, str(step + 1))
        recover(tmp_path / second)
        assert (tmp_path / second / "a").read_text() == text
        assert os.listdir(tmp_path / "one") == os.listdir(tmp_path / "two") == ["a"]
        seen.add(text == before)
    assert seen == {True, False}


def test_current_leads_to_what_waits(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with FileTransaction():
        write_text(path, "new")
        assert path.read_text() == "old"
        assert current_path(path).read_text() == "new" and current_path(path).suffix == ".txt"
        write_text(path, "newer")
        assert current_path(path).read_text() == "newer"
    assert path.read_text() == "newer" and os.listdir(tmp_path) == ["a.txt"]


def test_a_file_may_be_written_bit_by_bit(tmp_path: Path) -> None:
    with FileTransaction(), atomic_path(tmp_path / "big.csv") as temporary:
        with temporary.open("w") as stream:
            for row in range(1000):
                stream.write(f"{row}\n")
        assert not (tmp_path / "big.csv").exists()
    assert len((tmp_path / "big.csv").read_text().splitlines()) == 1000


def test_a_file_of_ours_that_somebody_changed_meanwhile_stays(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    write_text(path, "old")
    with refused("E-FILE-018"), FileTransaction():
        write_text(path, "new")
        path.write_text("theirs, and longer")
    assert path.read_text() == "theirs, and longer" and os.listdir(tmp_path) == ["estimates.yaml"]


def test_what_somebody_wrote_after_the_kill_is_not_replaced(tmp_path: Path) -> None:
    write_run(tmp_path, "old")
    for step in range(400):
        assert killed_at(step, lambda: write_run(tmp_path, "new"))
        if any((stage / "journal.json").exists() for stage in tmp_path.glob(PREFIX + "*")):
            break
        recover(tmp_path)
    (tmp_path / "b").write_text("written by hand")
    with refused("E-FILE-015", "b"):
        recover(tmp_path)
    assert (tmp_path / "b").read_text() == "written by hand"


def test_leftovers_go_but_nothing_else(tmp_path: Path) -> None:
    """A folder of a similar name that flexcal did not make stays, and so does that of a run that is alive."""
    alive = Stage.open(tmp_path, "flexcal demo", ("x",))
    theirs = tmp_path / f"{PREFIX}notes"
    theirs.mkdir()
    (theirs / "thesis.tex").write_text("mine")
    in_child(lambda: Stage.open(tmp_path, "flexcal demo", ("x",)) and None)
    assert len(os.listdir(tmp_path)) == 3
    recover(tmp_path)
    assert sorted(os.listdir(tmp_path)) == sorted([alive.path.name, theirs.name])
    assert (theirs / "thesis.tex").read_text() == "mine"


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    write_run(tmp_path, "old")

    def full(_handle: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with refused("E-FILE-011", str(tmp_path / "a"), os.strerror(number)):
        write_run(tmp_path, "new")
    (tmp_path / "mine").write_text("mine")
    assert whole(tmp_path) == "old"


def test_renaming_that_fails_is_finished_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").write_text("mine")
    write_run(tmp_path, "old")
    renamed = Path.replace

    def fails(self: Path, target: Path) -> Path:
        if target.name == "b":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return renamed(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", fails)
        with refused("E-FILE-016"):
            write_run(tmp_path, "new")
    recover(tmp_path)
    assert whole(tmp_path) == "new"


def test_no_file_of_flexcals_own(tmp_path: Path) -> None:
    """Links, pipes, devices and folders are not replaced."""
    (tmp_path / "target").write_text("mine")
    (tmp_path / "link").symlink_to("target")
    (tmp_path / "dangling").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, kind in {
        "link": "a link",
        "dangling": "a link",
        "pipe": "a pipe",
        "folder": "a folder",
    }.items():
        with refused("E-FILE-013", str(tmp_path / name), kind):
            write_text(tmp_path / name, "new")
    with refused("E-FILE-013", "/dev/null", "a device"):
        write_text("/dev/null", "new")
    assert (tmp_path / "target").read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == ["dangling", "folder", "link", "pipe", "target"]


def test_what_is_read_once_or_has_no_end_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for path, kind in (
        (tmp_path / "pipe", "pipe"),
        (tmp_path / "link", "pipe"),
        (Path("/dev/zero"), "device"),
    ):
        with refused("E-FILE-014", str(path), kind):
            current_path(path)
    assert current_path(tmp_path / "none") == tmp_path / "none" and current_path(tmp_path) == tmp_path


if __name__ == "__main__":
    os.fsync = lambda handle: None  # as in all tests
    globals()[sys.argv[1]](Path(sys.argv[2]))
