"""Files of one run take their places together; where it is killed meanwhile, readers say so, and the next run works.

Processes that are to be killed are forked, some thousand of them, by one that has little memory to copy.
"""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.cli.folders.overwrite_protection import outputs
from flexcal.errors import InputError
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import read_estimates, write_estimates
from flexcal.files.transaction import (
    FileTransaction,
    Ledger,
    append_lines,
    atomic_path,
    current_path,
    digest_on_disk,
    left_over,
    refuse_mixture,
    whole_lines,
    write_text,
)

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


def run_in(folder: Path) -> str:
    """Which run the files of a folder are of, as a reader finds them; empty without files. Raises `InputError` for those of two."""
    names = {
        name for name in (os.listdir(folder) if folder.exists() else ()) if not name.startswith(".flexcal")
    }
    if not names:
        return ""
    refuse_mixture(folder)
    texts = {(folder / name).read_text() for name in names - {"mine"}}
    assert len(texts) == 1
    (text,) = texts
    assert names - {"mine"} == {"a", "b", text}
    return text


def write_run(folder: Path, text: str) -> None:
    """Three files, one of which the other run does not write."""
    with outputs("demo", folder, ("a", "b", "old", "new")):
        for name in ("a", text, "b"):
            write_text(folder / name, text)


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {
        path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".flexcal-")
    }


def test_killed_at_any_step(tmp_path: Path) -> None:
    """A reader finds one run or is told of two; users' files stay, and after the next run all is as if none had been killed."""
    in_small_process(kill_at_any_step, tmp_path)


def kill_at_any_step(tmp_path: Path) -> None:
    found = {"old": 0, "new": 0, "two": 0}
    reference = tmp_path / "reference"
    for text in ("old", "new"):
        write_run(reference, text)
    expected = bytes_of(reference)
    for step in range(1000):
        folder = tmp_path / str(step)
        write_run(folder, "old")
        (folder / "mine").write_text("mine")
        if not killed_at(step, lambda folder=folder: write_run(folder, "new")):
            break
        try:
            found[run_in(folder)] += 1
        except InputError as problem:
            assert problem.code == "E-FILE-030" and "'flexcal demo'" in str(problem)
            found["two"] += 1
        if step % 2:  # once more, while it is put right
            killed_at(step - 3, lambda folder=folder: write_run(folder, "new"))
        left = left_over(folder)
        write_run(folder, "new")
        assert bytes_of(folder) == {**expected, "mine": b"mine"}
        assert left_over(folder) == left, (left_over(folder), left, step)
        shutil.rmtree(folder)
    else:
        raise AssertionError("the run never ended")
    assert found["old"] > 10 and found["new"] >= 1 and found["two"] == 3, found


def test_a_new_folder_appears_whole(tmp_path: Path) -> None:
    in_small_process(kill_before_a_new_folder, tmp_path)


def kill_before_a_new_folder(tmp_path: Path) -> None:
    found = {"": 0, "new": 0}
    for step in range(1000):
        folder = tmp_path / str(step) / "out" / "inner"
        if not killed_at(step, lambda folder=folder: write_run(folder, "new")):
            break
        found[run_in(folder)] += 1
        write_run(folder, "new")
        assert run_in(folder) == "new"
    assert found[""] > 10 and found["new"] >= 1, found


def estimate(value: float) -> Estimate:
    return Estimate(
        parameters=Parameters([Parameter("joint_1.offset", "rad", value)]),
        covariance=np.array([[value]]),
        rank=1,
        cost=0.0,
        chi2=0.0,
        degrees_of_freedom=1,
        status="converged",
        message="",
        iterations=1,
        dropped=(),
        identifiable=(True,),
    )


def test_estimates_are_never_lost(tmp_path: Path) -> None:
    in_small_process(kill_while_estimates_are_written, tmp_path)


def kill_while_estimates_are_written(tmp_path: Path) -> None:
    """Killed anywhere, also after several blocks were written in one run, the file holds what it held, or the new estimates."""

    def write(path: Path) -> None:
        with FileTransaction():
            write_estimates(path, "stiffness", estimate(3.0))
            write_estimates(path, "calibration", estimate(4.0))
            write_estimates(path, "stiffness", estimate(5.0))

    def state(path: Path) -> tuple[float, ...]:
        return tuple(float(one.covariance[0, 0]) for one in read_estimates(path).values())

    found = set()
    for step in range(1000):
        path = tmp_path / str(step) / "estimates.yaml"
        write_estimates(path, "stiffness", estimate(1.0))
        write_estimates(path, "calibration", estimate(2.0))
        if not killed_at(step, lambda path=path: write(path)):
            break
        found.add(state(path))
        write(path)
        assert state(path) == (5.0, 4.0)
    assert found == {(1.0, 2.0), (5.0, 4.0)}


def test_blocks_that_are_written_at_once(tmp_path: Path) -> None:
    """Two processes that write different blocks of one file lose neither."""
    path = tmp_path / "estimates.yaml"
    for _ in range(4):
        path.unlink(missing_ok=True)
        children = []
        for block in ("stiffness", "calibration", "dynamics", "payload"):
            child = os.fork()
            if child == 0:
                try:
                    write_estimates(path, block, estimate(1.0))
                finally:
                    os._exit(0)
            children.append(child)
        for child in children:
            os.waitpid(child, 0)
        assert len(read_estimates(path)) == 4


def test_lines_that_are_appended(tmp_path: Path) -> None:
    """Killed anywhere, the file has its whole lines; what is torn goes with the next line."""
    path = tmp_path / "rows"
    append_lines(path, ["1", "2"])
    with path.open("a") as stream:
        stream.write("torn" * 30_000)
    assert list(whole_lines(path)) == ["1", "2"]
    append_lines(path, ["3"])
    assert path.read_text() == "1\n2\n3\n"
    path.unlink()
    path.symlink_to(tmp_path / "elsewhere")
    with refused("E-FILE-013", "a link"):
        append_lines(path, ["4"])
    assert not (tmp_path / "elsewhere").exists()


HOSTILE = {
    "owner": "calibrate\n1\n*",
    "journal.json": '{"changes": [["1.sh", "../../home/.profile", null]], "stages": ["../../home/docs", "."]}',
    "1.sh": "echo",
    "primary": "../.flexcal-run-other",
}
"""What finished a run that had been cut off, in earlier versions."""


def test_nothing_that_is_found_acts(tmp_path: Path) -> None:
    """No file of a folder, however it is named, causes a write or a deletion, and the folder's own files stay."""
    home, folder = tmp_path / "home", tmp_path / "project"
    (home / "docs").mkdir(parents=True)
    (home / "docs" / "thesis.tex").write_text("mine")
    stage = folder / ".flexcal-run-1"
    stage.mkdir(parents=True)
    for name, content in HOSTILE.items():
        (stage / name).write_text(content)
    (folder / ".flexcal-0123456789abcdef").symlink_to(home)
    before = {path: path.lstat() for path in sorted(tmp_path.rglob("*"))}
    write_run(folder, "new")
    write_run(folder / "out", "new")
    after = {path: path.lstat() for path in sorted(tmp_path.rglob("*"))}
    assert all(after[path].st_mtime_ns == stat.st_mtime_ns for path, stat in before.items() if path.is_file())
    assert {path.relative_to(folder).parts[0] for path in after.keys() - before.keys()} == {
        "a",
        "b",
        "new",
        ".flexcal",
        "out",
    }


def test_a_forged_ledger_reaches_nothing(tmp_path: Path) -> None:
    """Names that lead out of the folder, or can be none, and verbs that there are not, do not count; nor does it have files removed."""
    (tmp_path / "secret").write_text("mine")
    out = tmp_path / "out"
    out.mkdir()
    (out / "kept.txt").write_text("kept")
    digest = digest_on_disk(out / "kept.txt")
    lines = [f"{0:064d}  {name}" for name in ("../secret", "/dev/zero", "a\0b", "", "x/../../secret")]
    text = "\n".join(
        [
            "# flexcal demo",
            f"{digest}  kept.txt",
            "# being written: flexcal x; rm -rf ~",
            *lines,
            f"{0:064d}  b",
        ]
    )
    (out / ".flexcal").write_text(text + "\n")
    ledger = Ledger.read(out)
    assert (
        list(ledger.change) == ["b"]
        and ledger.verb == "another verb"
        and list(ledger.entries) == ["kept.txt"]
    )
    with outputs("demo", out, ("**",)):
        write_text(out / "new.txt", "new")
    assert sorted(os.listdir(out)) == [".flexcal", "kept.txt", "new.txt"]
    with (out / "huge").open("wb") as stream:
        stream.truncate(10**10)
    with refused("E-FILE-020", "huge"), outputs("demo", out, ("**",)):
        pass


def test_a_link_in_the_place_of_an_output_folder_that_nobody_named(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "recheck").symlink_to("mine")
    with refused("E-FILE-029", "recheck"), outputs("recheck", tmp_path / "recheck", ("a",), is_named=False):
        pass
    with outputs("recheck", tmp_path / "recheck", ("a",)):
        write_text(tmp_path / "recheck" / "a", "new")
    assert (tmp_path / "mine" / "a").read_text() == "new"


@pytest.mark.parametrize(("target", "code"), [("elsewhere", "E-FILE-029"), ("nowhere", "E-FILE-013")])
def test_no_link_below_the_named_folder_is_followed(tmp_path: Path, target: str, code: str) -> None:
    """The folder that was named may be one; folders and files in it may not."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "a").write_text("mine")
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to("real")
    (tmp_path / "real" / "inner").symlink_to(tmp_path / target)
    with refused(code, "inner"), outputs("demo", tmp_path / "out", ("**",)):
        write_text(tmp_path / "out" / "inner" / "a", "new")
    with outputs("verify", tmp_path / "out", ("a",)):
        write_text(tmp_path / "out" / "a", "new")
    assert (tmp_path / "real" / "a").read_text() == "new"
    assert (
        os.listdir(tmp_path / "elsewhere") == ["a"] and (tmp_path / "elsewhere" / "a").read_text() == "mine"
    )


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


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    write_run(tmp_path / "out", "old")

    def full(_handle: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with refused("E-FILE-011", str(tmp_path / "out" / "a"), os.strerror(number)):
        write_run(tmp_path / "out", "new")
    assert run_in(tmp_path / "out") == "old"


def test_renaming_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says how much has changed; the next run puts it right."""
    write_run(tmp_path / "out", "old")
    renamed = Path.replace

    def fails(self: Path, target: Path) -> Path:
        if target.name == "b":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return renamed(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", fails)
        with refused("E-FILE-016", "3 of 6 changes"):
            write_run(tmp_path / "out", "new")
    with refused("E-FILE-030", "'flexcal demo'"):
        refuse_mixture(tmp_path / "out")
    write_run(tmp_path / "out", "new")
    assert run_in(tmp_path / "out") == "new" and not left_over(tmp_path / "out")


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
