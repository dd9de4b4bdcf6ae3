"""Workers by the words of the command line."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager

from flexcal.errors import InputError
from flexcal.parallel.dask_cluster import DaskCluster
from flexcal.parallel.local_processes import LocalProcesses
from flexcal.parallel.this_process import ThisProcess
from flexcal.parallel.workers import Workers

_ADDRESS = re.compile(r"(dask|tls)://[^\s/]+:\d+")


@contextmanager
def open_workers(on: str | None, jobs: int) -> Iterator[Workers]:
    """Workers, which end with the block.

    Parameters
    ----------
    on : str or None
        Address of a Dask scheduler, as `DaskCluster` has it; None: this machine.
    jobs : int
        Processes on this machine, of which more than two a core are not started; with 1, tasks run in this process. Of no meaning on a
        cluster.

    Raises
    ------
    InputError
        For an address that is none, and as `DaskCluster` does.
    """
    if on is not None and not _ADDRESS.fullmatch(on):
        raise InputError(
            "E-WORK-006",
            f"'{on}' is no address of a Dask scheduler; write dask://host:port or tls://host:port.",
        )
    workers = _here(jobs) if on is None else DaskCluster(on)
    try:
        yield workers
    finally:
        workers.close()


def _here(jobs: int) -> Workers:
    return ThisProcess() if jobs == 1 else LocalProcesses(min(jobs, 2 * (os.cpu_count() or 1)))
