"""Signals, closed and full streams, and folders and names that are out of the ordinary."""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cli_files import FLEXCAL, snapshot
from refusals import assert_refusal
from waiting import PATIENCE, until

from flexcal.cli.terminal.stop_signals import StopSignal
from flexcal.files.transaction import LEDGER, left_over

PLAN = ("--random", "--count", "3")
AT_WORK = """
import sys, time
from pathlib import Path
from flexcal.files.transaction import write_text
from flexcal.cli.main import main
from flexcal.cli.verbs.repeatability import Repeatability

def run(self):
    for name in ("results.json", "report.html"):
        write_text(self.out / name, "new")
    print("results", flush=True)
    Path("at_work").touch()
    time.sleep(1000)

Repeatability.run = run
sys.exit(main(["repeatability", "robot.yaml", "visits.csv", "--out", "out"]))
"""
"""A verb that has written all of its files and computes on."""


@pytest.fixture
def folder(ur5_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot's folder, which is the current one."""
    monkeypatch.chdir(ur5_folder)
    return ur5_folder


def flexcal(*arguments: str | bytes, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(FLEXCAL), *arguments],
        **{"capture_output": True, "text": True, "errors": "surrogateescape"} | options,
    )


def planned(folder: Path, count: int, out: str = "plan.yaml") -> None:
    done = flexcal(
        "design", "poses", "robot.yaml", "--random", "--count", str(count), "--out", out, cwd=folder
    )
    assert done.returncode == 0, done.stderr


def heed_signals() -> None:
    """A shell lets what it runs in the background ignore Ctrl-C."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def at_work(folder: Path) -> subprocess.Popen[str]:
    """The verb at work, its files waiting."""
    process = subprocess.Popen(
        [sys.executable, "-c", AT_WORK],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        preexec_fn=heed_signals,
    )
    until(lambda: (folder / "at_work").exists() or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    return process


@pytest.mark.parametrize(
    ("number", "status", "said"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "stopped"), (signal.SIGHUP, 129, "stopped")],
)
def test_a_signal_changes_nothing(folder: Path, number: int, status: int, said: str) -> None:
    process = at_work(folder)
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (status, "results\n")
    assert err.startswith(f"flexcal: {said}") and err.count("\n") == 1
    assert not (folder / "out").exists() and not left_over(folder)


def test_ctrl_c_while_the_program_loads_ends_it_quietly() -> None:
    program = "import os, signal, sys; sys.argv[0] = 'bin/flexcal'; import flexcal; os.kill(os.getpid(), signal.SIGINT)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, preexec_fn=heed_signals, check=False
    )
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "")


def test_a_signal_raises_between_begin_and_end_alone() -> None:
    early, late = StopSignal(), StopSignal()
    early.ask(signal.SIGTERM, None)
    with pytest.raises(KeyboardInterrupt):
        early.begin()
    late.begin()
    late.end()
    late.ask(signal.SIGINT, None)
    assert (early.status, late.status) == (143, 130)


def test_killed_and_run_again(folder: Path) -> None:
    process = at_work(folder)
    second = subprocess.run(
        [sys.executable, "-c", AT_WORK],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=PATIENCE,
        check=False,
    )
    assert second.returncode == 2
    assert_refusal(second.stderr, "E-CLI-012", "'flexcal repeatability'", f"process {process.pid}")
    process.kill()
    process.communicate()
    assert not os.listdir(folder / "out") and len(left_over(folder)) == 1
    again = subprocess.run(
        [sys.executable, "-c", AT_WORK.replace("sleep(1000)", "sleep(0)")],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
    )
    assert (again.returncode, again.stdout) == (0, "results\n")
    assert sorted(os.listdir(folder / "out")) == [LEDGER, "report.html", "results.json"]


@pytest.mark.parametrize(
    "redirection",
    ["| head -c 1", ">&-", "2>&-", ">&- 2>&-", "2>&1 | head -c 1", "<&-", "2>/dev/full", "2>&1 | true"],
)
def test_streams_that_nobody_reads(folder: Path, redirection: str) -> None:
    """The files are written whatever becomes of the messages; no traceback is among these."""
    script = f"set -o pipefail; '{FLEXCAL}' init ur5.urdf --out made {redirection}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=folder, check=False)
    assert (
        done.returncode == 0
        and "Traceback" not in done.stdout + done.stderr
        and "Exception" not in done.stderr
    )
    assert b"\nrobot: ../ur5.urdf" in (folder / "made" / "robot.yaml").read_bytes()


def test_full_standard_output(folder: Path) -> None:
    with open("/dev/full", "w") as full:
        done = flexcal(
            "design",
            "poses",
            "robot.yaml",
            *PLAN,
            "--out",
            "plan.yaml",
            capture_output=False,
            stdout=full,
            stderr=subprocess.PIPE,
        )
    assert done.returncode == 2 and (folder / "plan.yaml").exists()
    assert done.stderr.count("\n") == 1
    assert_refusal(done.stderr, "E-CLI-019", "No space left on device")


def test_a_file_that_grows_too_large(folder: Path) -> None:
    """As on a full disk, the file of before stays."""
    planned(folder, 3)
    before = snapshot(folder)
    done = flexcal(
        *("design", "poses", "robot.yaml", "--random", "--count", "2000", "--out", "plan.yaml"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
    )
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("flexcal: plan.yaml ") and done.stderr.count("\n") == 1
    assert_refusal(done.stderr, "E-FILE-011", "File too large")
    assert snapshot(folder) == before


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 16 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    if (
        mount is None
        or subprocess.run(
            [mount, "-t", "tmpfs", "-o", "size=16m", "tmpfs", str(disk)], capture_output=True, check=False
        ).returncode
    ):
        pytest.skip("no right to mount a file system")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_full_disk(folder: Path, small_disk: Path) -> None:
    planned(folder, 3, f"{small_disk}/plan.yaml")
    left = shutil.disk_usage(small_disk).free
    (small_disk / "other").write_bytes(bytes(left - 8192))
    before = snapshot(small_disk)
    done = flexcal(
        "design", "poses", "robot.yaml", "--random", "--count", "4", "--out", f"{small_disk}/plan.yaml"
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert re.match(rf"flexcal: {small_disk}/plan.(yaml|html) ", done.stderr)
    assert_refusal(done.stderr, "E-FILE-011", "No space left on device")
    assert snapshot(small_disk) == before
    (small_disk / "other").write_bytes(bytes(left))
    done = flexcal(
        "design", "poses", "robot.yaml", "--random", "--count", "4", "--out", f"{small_disk}/plan.yaml"
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert_refusal(done.stderr, "E-CLI-011", str(small_disk))
    (small_disk / "other").unlink()
    assert snapshot(small_disk) == {name: content for name, content in before.items() if name != "other"}
    planned(folder, 4, f"{small_disk}/plan.yaml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out").chmod(0o500)
    done = flexcal("design", "poses", "robot.yaml", *PLAN, "--out", "out/plan.yaml")
    assert done.returncode == 2
    assert_refusal(done.stderr, "E-CLI-011", "out", "Permission denied")


@pytest.mark.parametrize("kind", ["link", "dangling", "pipe", "device", "folder"])
def test_what_is_no_regular_file(folder: Path, kind: str) -> None:
    out = folder / "plan.yaml"
    target = folder / "target"
    if kind == "link":
        target.write_text("mine")
    if kind in ("link", "dangling"):
        out.symlink_to(target)
    elif kind == "pipe":
        os.mkfifo(out)
    elif kind == "folder":
        out.mkdir()
    done = flexcal(
        "design",
        "poses",
        "robot.yaml",
        *PLAN,
        "--out",
        "/dev/null" if kind == "device" else "plan.yaml",
        timeout=PATIENCE,
    )
    named = {"dangling": "a link", "folder": "a folder"}.get(kind, f"a {kind}")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert_refusal(done.stderr, "E-CLI-010" if kind == "folder" else "E-FILE-013", named)
    assert os.path.lexists(out) == (kind != "device") and target.exists() == (kind == "link")
    assert not left_over(folder)


@pytest.mark.parametrize("kind", ["link", "pipe"])
def test_what_is_no_regular_file_in_a_folder(folder: Path, kind: str) -> None:
    (folder / "out").mkdir()
    page = folder / "out" / "report.html"
    page.symlink_to("/etc/hostname") if kind == "link" else os.mkfifo(page)
    done = flexcal(
        "calibrate", "robot.yaml", "random.csv", "--terms", "kinematic", "--out", "out", timeout=PATIENCE
    )
    assert done.returncode == 2
    assert_refusal(done.stderr, "E-FILE-013", "out/report.html", kind)
    assert os.listdir(folder / "out") == ["report.html"]


def test_a_current_folder_that_was_removed(folder: Path) -> None:
    script = f"mkdir gone && cd gone && rmdir ../gone && exec '{FLEXCAL}' "
    robot = folder / "robot.yaml"
    for given, status in {
        "--version": 0,
        "design poses --help": 0,
        f"design poses {robot} --random --count 3": 2,
        f"design poses {robot} --random --count 3 --out {folder}/plan.yaml": 0,
        "calibrate robot.yaml random.csv": 2,
    }.items():
        done = subprocess.run(
            ["bash", "-c", script + given], capture_output=True, text=True, cwd=folder, check=False
        )
        assert done.returncode == status and "Traceback" not in done.stderr, done.stderr
        if status:
            assert done.stderr.count("\n") == 1
            assert_refusal(done.stderr, "E-CLI-015")
    assert (folder / "plan.yaml").exists()


@pytest.mark.parametrize("name", [b"\xff\xe9\n\\", " 'x' \"жß\" -".encode()])
def test_names_that_are_no_text(folder: Path, name: bytes) -> None:
    """Of folders and files that are read and written; a ledger with such names is read again."""
    place = os.fsencode(folder) + b"/" + name
    os.mkdir(place)
    given, poses = place + b"/" + name + b".dat", place + b"/" + name + b".csv"
    shutil.copy(folder / "random.csv", os.fsdecode(given))
    for _ in range(2):
        done = flexcal("import", "robot.yaml", given, "--out", poses)
        assert (done.returncode, done.stderr) == (0, "")
    done = flexcal("verify", place + b"/none.yaml", poses)
    assert done.returncode == 2 and done.stderr.count("flexcal: ") == 1 and "Traceback" not in done.stderr


@pytest.mark.slow
def test_results_of_files_whose_names_are_no_text(folder: Path) -> None:
    poses = os.fsencode(folder) + b"/\xff\xe9.csv"
    shutil.copy(folder / "random.csv", os.fsdecode(poses))
    place = os.fsencode(folder) + b"/\xe9"
    command = (
        "calibrate",
        "robot.yaml",
        poses,
        "--terms",
        "kinematic",
        "--loss",
        "squares",
        "--out",
        place + b"/out",
    )
    for arguments in (command, ("report", place + b"/out"), command):
        done = flexcal(*arguments)
        assert done.returncode == 0, done.stderr
