"""The files that the verbs hand to each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.data import MultisinePlan, PosePlan, read_plan
from flexcal.errors import InputError
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel


def robot_file(plan: Path, given: Path | None) -> Path:
    """The robot.yaml of a plan: the one given, else that beside the plan, else that in the current folder; raises `InputError`."""
    if given is not None:
        return given
    for folder in (plan.parent, Path()):
        if (folder / "robot.yaml").is_file():
            return folder / "robot.yaml"
    raise InputError(f"there is no robot.yaml beside {plan} nor in the current folder; name it with --robot.")


def example_robot(name: str) -> Path:
    """robot.yaml of an example: in `examples/` of the current folder, else of flexcal's checkout; raises `InputError`."""
    places = [Path("examples"), Path(__file__).parents[3] / "examples"]
    for place in places:
        if (place / name / "robot.yaml").is_file():
            return place / name / "robot.yaml"
    raise InputError(
        f"the example '{name}' is not here; run in flexcal's folder, or name a robot.yaml with --robot."
    )


def read_fitting_plan(path: Path, model: RobotModel) -> MultisinePlan | PosePlan:
    """A plan for this robot; raises `InputError` where it has another number of joints."""
    plan = read_plan(path)
    joints = (plan.poses if isinstance(plan, MultisinePlan) else plan.q).shape[1]
    if joints != model.n:
        raise InputError(
            f"{path}: the plan is for {joints} joints, but {model.path} has {model.n}; give the plan of this robot."
        )
    return plan


def read_responses(paths: Sequence[Path]) -> tuple[list[Path], list[FrequencyResponse]]:
    """Frequency responses from files, or from all .npz files of folders, in the order of their poses; raises `InputError`."""
    files: list[Path] = []
    for path in paths:
        found = sorted(path.glob("*.npz")) if path.is_dir() else [path]
        if not found:
            raise InputError(
                f"{path} holds no frequency responses (.npz); run 'flexcal identify response' first."
            )
        files += found
    responses = [FrequencyResponse.load(file) for file in files]
    order = sorted(range(len(files)), key=lambda i: responses[i].pose)
    return [files[i] for i in order], [responses[i] for i in order]
