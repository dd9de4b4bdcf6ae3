"""A Dask scheduler with two worker processes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import distributed
import pytest


@pytest.fixture(scope="session")
def cluster() -> Iterator[distributed.LocalCluster]:
    """Scheduler in this process, and two workers that are started again where they are killed."""
    started: Any = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0")
    with started:
        yield started


@pytest.fixture
def address(cluster: distributed.LocalCluster) -> str:
    """As `--on` takes it."""
    return cluster.scheduler_address.replace("tcp://", "dask://")
