"""Files appear whole or not at all."""

import os
from pathlib import Path
from threading import Thread

import pytest
from refusals import refused

from flexcal.files.transaction import atomic_path, atomic_paths, write_text


def test_writes_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.txt"
    write_text(path, "é\n")
    assert path.read_bytes() == "é\n".encode()
    write_text(path, "\0\r\n")
    assert path.read_bytes() == b"\x00\r\n"
    assert os.listdir(path.parent) == ["a.txt"]


def test_keeps_the_old_file_when_it_fails(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with pytest.raises(RuntimeError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_files_that_belong_together_appear_together(tmp_path: Path) -> None:
    a, b = tmp_path / "a.npz", tmp_path / "b.yaml"
    write_text(a, "old")
    with pytest.raises(KeyboardInterrupt), atomic_paths(a, b) as (first, second):
        first.write_text("new")
        second.write_text("half")
        raise KeyboardInterrupt
    assert a.read_text() == "old" and os.listdir(tmp_path) == ["a.npz"]
    with atomic_paths(a, b) as (first, second):
        first.write_text("new")
        assert not b.exists() and a.read_text() == "old"
        second.write_text("new")
    assert a.read_text() == b.read_text() == "new" and sorted(os.listdir(tmp_path)) == ["a.npz", "b.yaml"]
    (tmp_path / "c.yaml").mkdir()
    with (
        refused("E-FILE-013", "a folder"),
        atomic_paths(tmp_path / "c.npz", tmp_path / "c.yaml"),
    ):
        pass
    assert not (tmp_path / "c.npz").exists()


def test_threads_do_not_wait_for_each_other(tmp_path: Path) -> None:
    """A file that one thread has finished is there, whatever another has begun meanwhile."""
    with atomic_path(tmp_path / "long") as temporary:
        other = Thread(target=write_text, args=(tmp_path / "short", "1"))
        other.start()
        other.join()
        assert os.listdir(tmp_path).count("short") == 1
        temporary.write_text("2")
    assert sorted(os.listdir(tmp_path)) == ["long", "short"]


def test_permissions_are_those_of_a_plain_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_text("")
    write_text(tmp_path / "atomic", "")
    assert (tmp_path / "atomic").stat().st_mode == plain.stat().st_mode


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with refused("E-FILE-012"):
        write_text(tmp_path / "file" / "a.txt", "")
    with refused("E-FILE-013", "a folder"):
        write_text(tmp_path, "")
