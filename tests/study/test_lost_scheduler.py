"""A scheduler that is killed while a study runs, and started again."""

from __future__ import annotations

import socket
import subprocess
import sys
from contextlib import closing
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
        words = {"scheduler": ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]}
        words["worker"] = [f"tcp://127.0.0.1:{port}", "--no-nanny", "--no-dashboard", "--nthreads", "1"]
        self.processes = [
            subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{name}", *given], stderr=subprocess.DEVNULL
            )
            for name, given in words.items()
        ]

    def kill(self) -> None:
        """End both at once."""
        for process in self.processes:
            process.kill()
            process.wait()


def test_a_study_goes_on_when_the_scheduler_is_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flexcal.jobs.study.store._EVERY", 0.0)
    monkeypatch.setattr("flexcal.jobs.study.store._SHARE", 0.0)
    with closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
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
        assert 2 <= len(list((out / "parts").glob("*.parquet"))) < 4
        cluster = Cluster(port)
        with open_workers(f"dask://127.0.0.1:{port}", 1) as workers:
            run_study(plan, out, workers, resume=True)
    finally:
        cluster.kill()
    run_study(plan, tmp_path / "here", ThisProcess())
    assert_frame_equal(stored(out), stored(tmp_path / "here"), check_exact=True)
