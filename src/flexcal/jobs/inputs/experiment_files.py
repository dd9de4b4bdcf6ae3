"""Lookup and reading of files that verbs pass to each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.data.experiments import PLAN
from flexcal.data.plans import MultisinePlan, Plan, read_plan, read_plan_of
from flexcal.errors import InputError
from flexcal.files.formats import to_plain
from flexcal.files.transaction import refuse_mixture
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.inputs.distinct_files import require_distinct_files
from flexcal.model.robot import RobotModel

FREQUENCY_PLAN = "frequency_plan.yaml"
_PLANS = (PLAN, FREQUENCY_PLAN)
"""Paths of the frequency plan in a folder of responses: as 'identify response' writes it, and as the demo does."""


def robot_file(plan: Path, given: Path | None) -> Path:
    """Path of a plan's robot.yaml: the given one, else beside the plan, else in the current folder; raises `InputError`."""
    if given is not None:
        return given
    for folder in (plan.parent, Path()):
        if (folder / "robot.yaml").is_file():
            return folder / "robot.yaml"
    raise InputError(
        "E-RUN-046", f"there is no robot.yaml beside {plan} nor in the current folder; name it with --robot."
    )


def example_robot(name: str) -> Path:
    """Path of an example's robot.yaml: in `examples/` of the current folder, else of flexcal's checkout; raises `InputError`."""
    places = [Path("examples"), Path(__file__).parents[4] / "examples"]
    for place in places:
        if (place / name / "robot.yaml").is_file():
            return place / name / "robot.yaml"
    raise InputError(
        "E-RUN-047",
        f"the example '{name}' is not here; run in flexcal's folder, or name a robot.yaml with --robot.",
    )


def read_plan_for_robot(path: Path, model: RobotModel) -> Plan:
    """Plan for this robot; raises `InputError` for a different number of joints."""
    plan = read_plan(path)
    if plan.joint_count != model.n:
        raise InputError(
            "E-RUN-048",
            f"{path}: the plan is for {plan.joint_count} joints, but {model.path} has {model.n}; give the plan of this robot.",
        )
    return plan


def read_responses(paths: Sequence[Path], model: RobotModel) -> tuple[list[Path], list[FrequencyResponse]]:
    """Frequency responses of a robot from files, or from the response_pose_<p>.npz of folders, by pose number; raises `InputError`."""
    files: list[Path] = []
    for path in paths:
        there = [path]
        if path.is_dir():
            refuse_mixture(path)
            there = sorted(path.glob("response_pose_*.npz"))
        if not there:
            raise InputError(
                "E-RUN-049",
                f"{path} holds no frequency responses (response_pose_1.npz …); run 'flexcal identify response' first.",
            )
        files += there
    require_distinct_files(files)
    responses = [FrequencyResponse.load(file) for file in files]
    for file, response in zip(files, responses, strict=True):
        if response.q_mean.size != model.n:
            raise InputError(
                "E-RUN-050",
                f"{file} is of a robot of {response.q_mean.size} joints, but {model.path} has {model.n}; give the responses of this robot.",
            )
    order = sorted(range(len(files)), key=lambda i: responses[i].pose)
    return [files[i] for i in order], [responses[i] for i in order]


def plan_files(files: Sequence[Path]) -> list[Path]:
    """Frequency plans beside responses, one per folder; none if a folder lacks it."""
    folders = dict.fromkeys(file.parent for file in files)
    plans = [next((f / name for name in _PLANS if (f / name).is_file()), None) for f in folders]
    return [path for path in plans if path is not None] if all(plans) else []


def common_plan(paths: Sequence[Path]) -> MultisinePlan | None:
    """Plan common to these files, None without any; raises `InputError` if plans differ."""
    plans = [read_plan_of(path, MultisinePlan) for path in paths]
    for path, plan in zip(paths[1:], plans[1:], strict=True):
        if to_plain(plan) != to_plain(plans[0]):
            raise InputError(
                "E-RUN-051", f"{path} is another plan than {paths[0]}; identify from responses of one plan."
            )
    return plans[0] if plans else None
