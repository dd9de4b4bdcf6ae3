"""The joint logs that a verb is given, as files or as the folder of a plan of trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.data import TrajectoryPlan, labels, read_plan_of
from flexcal.data.experiment_folder import PLAN, existing_file


def recorded_logs(paths: Sequence[Path]) -> list[Path]:
    """The files, and those of folders as 'measure' leaves them; raises `InputError` for a folder that holds no trajectories."""
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            plan = read_plan_of(path / PLAN, TrajectoryPlan)
            found += [existing_file(path, label.name) for label in labels(plan)]
        else:
            found.append(path)
    return found
