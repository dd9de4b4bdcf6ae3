"""Carrying out a plan, in the virtual cell or on files recorded before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.cell import CellConfig, VirtualCell, draw_truth, read_truth, write_truth
from flexcal.data import (
    Cell,
    FolderCell,
    MultisinePlan,
    PosePlan,
    Recording,
    write_measured_poses,
    write_recordings,
)
from flexcal.errors import FlexcalError, InputError
from flexcal.model import RobotModel
from flexcal.workflow.experiment_files import read_fitting_plan
from flexcal.workflow.results import write_results
from flexcal.yaml_reader import read_yaml

Progress = Callable[[str, float], None]

VIRTUAL = "virtual"


@dataclass(frozen=True)
class Measurement:
    """What lies in `folder`: joint logs of a frequency experiment, or measured poses."""

    folder: Path
    kind: str
    poses: int
    recordings: int

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {"folder": self.folder, "kind": self.kind, "poses": self.poses, "recordings": self.recordings}


def measure(
    robot: Path,
    plan_file: Path,
    cell: str,
    out: Path,
    *,
    config: Path | None = None,
    seed: int = 0,
    truth: Path | None = None,
    progress: Progress | None = None,
) -> Measurement:
    """Carry out the plan in a file and leave the measurements, the plan and results.json in the folder `out`.

    `cell` is "virtual", or a folder with measurements by this very plan, which are checked and copied in the standard form. The virtual
    cell takes `config` (default: cell.yaml beside robot.yaml, where there is one); its hidden truth is drawn from `seed`, or taken from the
    file `truth`, and left in `out`/truth.yaml. Raises `FlexcalError` where files do not fit.
    """
    tell = progress or (lambda stage, share: None)
    model = RobotModel.from_yaml(robot, estimates=False)
    plan = read_fitting_plan(plan_file, model)
    if cell != VIRTUAL and Path(cell).resolve() == out.resolve():
        raise InputError(f"{out} is the folder measured before; give another --out.")
    source = _virtual(model, config, seed, truth, out) if cell == VIRTUAL else FolderCell(cell, model)
    if isinstance(plan, MultisinePlan):
        total = len(plan.poses) * plan.recordings_per_pose
        write_recordings(out, plan, _counted(source.record(plan), total, tell))
        result = Measurement(out, plan.kind, len(plan.poses), total)
    else:
        result = Measurement(out, plan.kind, _measure_poses(source, plan, out, tell), 0)
    write_results(out, result.document())
    return result


def _virtual(model: RobotModel, config: Path | None, seed: int, truth: Path | None, out: Path) -> VirtualCell:
    beside = model.path.parent / "cell.yaml"
    file = beside if config is None and beside.is_file() else config
    settings = CellConfig() if file is None else read_yaml(file, CellConfig)
    drawn = (
        draw_truth(model, settings.spread, np.random.default_rng([seed, 0]))
        if truth is None
        else read_truth(truth)
    )
    try:
        robot = model.with_values(drawn)
    except FlexcalError as problem:
        raise InputError(f"{truth or 'the drawn truth'}: {problem}") from problem
    write_truth(out / "truth.yaml", drawn)
    return VirtualCell(robot, settings, seed, controller_model=model)


def _measure_poses(source: Cell, plan: PosePlan, out: Path, tell: Progress) -> int:
    tell("measuring", 0.0)
    poses = source.measure(plan)
    write_measured_poses(out, plan, poses)
    tell("measuring", 1.0)
    return len(poses)


def _counted(recordings: Iterable[Recording], total: int, tell: Progress) -> Iterator[Recording]:
    tell("recording", 0.0)
    for number, recording in enumerate(recordings, start=1):
        yield recording
        tell("recording", number / total)
