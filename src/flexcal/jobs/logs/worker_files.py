"""Files as workers find them: those of a cluster have working directories of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.model.robot import RobotModel
from flexcal.parallel import DaskCluster, Workers


def worker_paths(paths: Sequence[Path], workers: Workers) -> list[Path]:
    """Paths for tasks; absolute ones for a cluster."""
    return [path.absolute() for path in paths] if isinstance(workers, DaskCluster) else list(paths)


def worker_robot(model: RobotModel, workers: Workers) -> RobotModel:
    """Robot for tasks, which find its files, and those named in its robot.yaml, by `worker_paths`."""
    path, urdf = worker_paths([model.path, model.urdf], workers)
    return replace(model, path=path, urdf=urdf)
