"""Worker processes do not outlive the process that asked them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE, until

PROGRAM = """
import os, sys, time
from pathlib import Path
from flexcal.jobs.logs import scratch_folder
from flexcal.parallel import open_workers

def work(folder):
    Path(folder, f"pid_{os.getpid()}").touch()
    time.sleep(1000)

with scratch_folder() as scratch:
    Path(sys.argv[1], scratch.name).touch()
    with open_workers(None, 2) as workers:
        list(workers.values(work, [sys.argv[1]] * 2))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_workers_end_with_who_asked_them(tmp_path: Path, number: int) -> None:
    """Ctrl-C comes to all processes of a terminal; a kill to one. Of the workers, nothing is heard."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(tmp_path)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )
    until(lambda: len(list(tmp_path.glob("pid_*"))) == 2 or process.poll() is not None)
    assert process.poll() is None
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    said = process.communicate(timeout=PATIENCE)[1]
    until(lambda: not any(alive(int(path.name[4:])) for path in tmp_path.glob("pid_*")))
    assert said.count("Traceback") == (number == signal.SIGINT)  # that of the program itself


def alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
