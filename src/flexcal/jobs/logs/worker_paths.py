"""Paths of logs as workers find them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.parallel import DaskCluster, Workers


def worker_paths(paths: Sequence[Path], workers: Workers) -> list[Path]:
    """Paths as the workers find them: those of a cluster have working directories of their own."""
    return [path.absolute() for path in paths] if isinstance(workers, DaskCluster) else list(paths)
