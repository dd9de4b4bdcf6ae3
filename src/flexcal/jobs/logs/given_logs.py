"""Joint logs passed by a caller: files, or recordings in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.data.recordings import Recording, write_recording
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel

JointLogs = Sequence[str | Path | Recording]


def model_for_logs(model: RobotModel, logs: JointLogs) -> RobotModel:
    """Robot for logs in memory, which are already in SI units at the joints; raises `FlexcalError` if mixed with files."""
    in_memory = sum(isinstance(log, Recording) for log in logs)
    if not in_memory or not model.config.signals:
        return model
    if in_memory < len(logs):
        raise FlexcalError(
            "E-RUN-033",
            f"{model.path} says how the columns of files are converted (`signals:`), so logs in memory cannot stand beside files; "
            "give one kind.",
        )
    return replace(model, config=replace(model.config, signals={}))


def log_files(logs: JointLogs, folder: Path, name: str) -> list[Path]:
    """Paths of the logs; logs in memory are written to `folder`."""
    files = []
    for number, log in enumerate(logs, start=1):
        if isinstance(log, Recording):
            files.append(folder / f"{name}_{number}.parquet")
            write_recording(files[-1], log)
        else:
            files.append(Path(log))
    return files


def log_names(files: Sequence[Path], folder: Path) -> tuple[Path, ...]:
    """What documents call the logs: files as they are, those in memory, written to `folder`, by their names alone."""
    return tuple(Path(file.name) if file.parent == folder else file for file in files)
