"""A scheduler that is killed while a study runs, and started again."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path

import pytest
from polars.testing import assert_frame_equal
from refusals import refused
from small_study import stored, write_study

from flexcal.jobs.study import read_study, run_study
from flexcal.parallel import ThisProcess, open_workers


class Cluster:
    """A scheduler on a port of this machine, and a worker, in processes of their own."""

    def __init__(self, port: int):
        self.processes: list[subprocess.Popen[bytes]] = []
        self.start("scheduler", "--host", "127.0.0.1", "--port", str(port))
        while True:  # until it listens
            assert self.processes[0].poll() is None, "the scheduler ended"
            with closing(socket.socket()) as tried:
                if tried.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        self.start("worker", f"tcp://127.0.0.1:{port}", "--no-nanny", "--nthreads", "1")

    def start(self, name: str, *words: str) -> None:
        """Start a program of Dask."""
        program = [sys.executable, "-m", f"distributed.cli.dask_{name}", "--no-dashboard", *words]
        self.processes.append(subprocess.Popen(program))

    def kill(self) -> None:
        """End both at once."""
        for process in self.processes:
            process.kill()
            process.wait()


def free_port() -> int:
    """A port below those that the system gives to connections, where none can take it between two schedulers."""
    for port in range(20000 + os.getpid() % 10000, 32768):
        with closing(socket.socket()) as tried, suppress(OSError):
            tried.bind(("127.0.0.1", port))
            return port
    raise OSError("no port is free")


@pytest.mark.parametrize("recount", [1e9, 0.0], ids=["missed_results", "asked_for_its_workers"])
def test_a_study_goes_on_when_the_scheduler_is_back(
    recount: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("flexcal.parallel.dask_cluster._RECOUNT", recount)
    port = free_port()
    plan, out = read_study(write_study(tmp_path)), tmp_path / "out"
    cluster = Cluster(port)

    def kill_at_the_second(stage: str, share: float) -> None:
        if share >= 0.5:
            cluster.kill()

    try:
        with (
            refused("E-WORK-003", f"dask://127.0.0.1:{port}"),
            open_workers(f"dask://127.0.0.1:{port}", 1) as workers,
        ):
            run_study(plan, out, workers, progress=kill_at_the_second)
        assert "distributed.client" not in capfd.readouterr().err  # its log says nothing beside the error
        assert 2 <= len((out / "tasks.jsonl").read_text().splitlines()) < 4
        cluster = Cluster(port)
        with open_workers(f"dask://127.0.0.1:{port}", 1) as workers:
            run_study(plan, out, workers, resume=True)
    finally:
        cluster.kill()
    run_study(plan, tmp_path / "here", ThisProcess())
    assert_frame_equal(stored(out), stored(tmp_path / "here"), check_exact=True)
