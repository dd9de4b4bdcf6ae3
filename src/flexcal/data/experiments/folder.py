"""A measured experiment as a folder: `plan.yaml`, then one joint log per recording, or `poses.csv`.

The log of pose p, realisation r, experiment e and sign s is `pose_<p>_realisation_<r>_experiment_<e>_<plus|minus>` with
the ending `.csv` or `.parquet`, all counted from 1: `pose_1_realisation_4_experiment_2_minus.parquet`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from flexcal.data.plans import MultisinePlan, PosePlan, TrajectoryPlan, write_plan
from flexcal.data.poses import PoseSet, write_poses
from flexcal.data.recordings import Recording, RecordingLabel, write_recording
from flexcal.errors import FlexcalError, InputError

PLAN = "plan.yaml"
POSES = "poses"
ENDINGS = (".parquet", ".csv")


def labels(plan: MultisinePlan | TrajectoryPlan) -> Iterator[RecordingLabel]:
    """Labels of a plan's recordings in the order of measurement: pose, realisation, experiment, sign.

    A trajectory counts as a realisation of the one pose.
    """
    if isinstance(plan, TrajectoryPlan):
        yield from (RecordingLabel(0, number, 0, 1) for number in range(len(plan)))
        return
    for pose in range(len(plan.poses)):
        for realisation in range(plan.realisations):
            for experiment in range(plan.experiments):
                for sign in (1, -1) if plan.signs else (1,):
                    yield RecordingLabel(pose, realisation, experiment, sign)


def existing_file(folder: Path, name: str) -> Path:
    """Path of the file of this name with either ending; raises `InputError` if there is none, or both."""
    files = [folder / (name + ending) for ending in ENDINGS if (folder / (name + ending)).is_file()]
    if not files:
        raise InputError(
            "E-EXP-001",
            f"{folder / name}.csv (or .parquet) is missing; record it, or give the folder that has it.",
        )
    if len(files) > 1:
        raise InputError("E-EXP-002", f"{folder / name} is there as .csv and as .parquet; remove one.")
    return files[0]


def write_recordings(
    folder: str | Path,
    plan: MultisinePlan | TrajectoryPlan,
    recordings: Iterable[Recording],
    *,
    ending: str = ".parquet",
) -> None:
    """Write recordings as they come, then the plan: a folder without `plan.yaml` is not complete.

    Raises `FlexcalError` where a recording has no label or one that the plan does not have, or one of the plan is not
    there.
    """
    folder = Path(folder)
    left = set(labels(plan))
    for recording in recordings:
        if recording.label is None or recording.label not in left:
            raise FlexcalError(
                "E-EXP-003", f"{recording.name} is not in the plan, or there twice; record the plan again."
            )
        left.remove(recording.label)
        write_recording(folder / (recording.label.name + ending), recording)
    if left:
        missing = min(label.name for label in left)
        raise FlexcalError(
            "E-EXP-004", f"{len(left)} recordings of the plan are missing, for example {missing}."
        )
    write_plan(folder / PLAN, plan)


def write_measured_poses(folder: str | Path, plan: PosePlan, poses: PoseSet) -> None:
    """Write `poses.csv`, then the plan."""
    write_poses(Path(folder) / (POSES + ".csv"), poses)
    write_plan(Path(folder) / PLAN, plan)
