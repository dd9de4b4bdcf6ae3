"""Execution of a plan, in the virtual cell or from recorded files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexcal.data.experiments import PLAN, Cell, FolderCell, labels, write_measured_poses, write_recordings
from flexcal.data.plans import MultisinePlan, PosePlan
from flexcal.data.recordings import Recording
from flexcal.errors import InputError, naming
from flexcal.files.formats import read_yaml, yaml_text
from flexcal.files.transaction import real_path
from flexcal.jobs.experiments.played_recordings import PlayedRecordings, plan_as_played
from flexcal.jobs.experiments.poses import VERIFICATION
from flexcal.jobs.inputs import read_plan_for_robot
from flexcal.jobs.result_files import header, write_results
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.virtual_cell import CellConfig, VirtualCell, write_truth

VIRTUAL = "virtual"


@dataclass(frozen=True)
class Measurement:
    """Measurements in `folder`: joint logs of an experiment, or measured poses, by a plan of this kind and name; `loaded` if with
    payload.
    """

    folder: Path
    kind: str
    plan: str
    poses: int
    recordings: int
    loaded: bool
    remarks: tuple[str, ...] = ()
    found: tuple[dict[str, Any], ...] = ()

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {
            **header("measurement"),
            "folder": self.folder,
            "plan_kind": self.kind,
            "plan": self.plan,
            "poses": self.poses,
            "recordings": self.recordings,
            "remarks": list(self.remarks),
            "found": list(self.found),
        }

    @property
    def for_verification(self) -> bool:
        """Whether the poses are random ones, reserved for verification."""
        return self.plan == VERIFICATION


def measure(
    robot_file: Path,
    plan_file: Path,
    cell: str,
    out: Path,
    *,
    config: Path | None = None,
    seed: int = 0,
    truth: Path | None = None,
    progress: Progress = silent,
) -> Measurement:
    """Carry out the plan in a file and leave the measurements, the plan and results.json in the folder `out`.

    `cell` is "virtual", or a folder with measurements by this very plan, which are checked and copied in the standard form; recordings of
    signals and trajectories may have any names, beginnings and rates (`PlayedRecordings`). The virtual cell takes `config` (default:
    cell.yaml beside robot.yaml, where there is one); its hidden truth is drawn from `seed`, or taken from the file `truth`, and left in
    `out`/truth.yaml. Raises `FlexcalError` where files do not fit, and where `out` holds the measurements of another plan.
    """
    model = RobotModel.from_yaml(robot_file, estimates=False)
    plan = read_plan_for_robot(plan_file, model)
    if cell != VIRTUAL and real_path(cell) == real_path(out):
        raise InputError("E-RUN-039", f"{out} is the folder measured before; give another --out.")
    if cell != VIRTUAL and not isinstance(plan, PosePlan):
        plan = plan_as_played(Path(cell), plan)
    before = out / PLAN
    if before.is_file() and yaml_text(read_plan_for_robot(before, model)) != yaml_text(plan):
        raise InputError("E-RUN-040", f"{out} holds what was measured by another plan; give another --out.")
    drawn: dict[str, float] = {}
    source: Cell | PlayedRecordings
    if cell == VIRTUAL:
        beside = model.path.parent / "cell.yaml"
        file = beside if config is None and beside.is_file() else config
        settings = CellConfig() if file is None else read_yaml(file, CellConfig)
        source, drawn = VirtualCell.drawn(model, settings, seed, truth)
    elif not isinstance(plan, PosePlan):
        source = PlayedRecordings(Path(cell), model)
    else:
        source = FolderCell(cell, model)
    if isinstance(plan, PosePlan):
        assert isinstance(source, Cell)
        result = Measurement(out, plan.kind, plan.name, _measure_poses(source, plan, out, progress), 0, False)
    else:
        total = len(list(labels(plan)))
        with naming(plan_file):
            write_recordings(out, plan, _counted(source.record(plan), total, progress))
        poses = len(plan.poses) if isinstance(plan, MultisinePlan) else 0
        loaded = plan.payload != 0 and model.payload is not None
        result = Measurement(out, plan.kind, plan.name, poses, total, loaded)
        if isinstance(source, PlayedRecordings):
            result = replace(result, remarks=tuple(source.remarks), found=tuple(source.found))
    if drawn:
        write_truth(out / "truth.yaml", drawn)
    write_results(out, result.document())
    return result


def _measure_poses(source: Cell, plan: PosePlan, out: Path, progress: Progress) -> int:
    progress("measuring", 0.0)
    poses = source.measure(plan)
    write_measured_poses(out, plan, poses)
    progress("measuring", 1.0)
    return len(poses)


def _counted(recordings: Iterable[Recording], total: int, progress: Progress) -> Iterator[Recording]:
    progress("recording", 0.0)
    for number, recording in enumerate(recordings, start=1):
        yield recording
        progress("recording", number / total)
