"""The stages of a calibration, and what the project's files allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import ESTIMATES, RESULTS
from flexcal.studio.project import CALIBRATION, MEASURED, Project, read_plan_file
from flexcal.studio.steps.results import ResultSource

INERTIALS, RESPONSES, STIFFNESS = "inertials", "responses", "stiffness"
"""Folders of results."""
State = Literal["done", "outdated", "ready", "blocked"]


@dataclass(frozen=True)
class Stage:
    """A stage: identification of one part of the model.

    Parameters
    ----------
    title : str
        Its name on the button.
    state : {"done", "outdated", "ready", "blocked"}
        Whether it has a result, one of other data than the chosen ones, none but can be run, or has no data.
    sentence : str
        What it tells, or why it is blocked and what to do.
    arguments : tuple of str
        Command line after `flexcal`.
    folder : str
        Folder of its result, in the project.
    """

    title: str
    state: State
    sentence: str
    arguments: tuple[str, ...]
    folder: str


def stages(project: Project, measured: str) -> list[Stage]:
    """The stages in their order; `measured` is the chosen file of measured poses, empty for none."""
    plans = _plans(project)
    excitation = next((folder for folder, kind in plans.items() if kind == "trajectory"), None)
    frequency = next((folder for folder, kind in plans.items() if kind == "multisine"), None)
    return [
        _stage(
            project,
            "Inertias and friction",
            excitation,
            ("identify", "inertials", "robot.yaml", excitation or "", "--out", INERTIALS),
            INERTIALS,
            "no recordings of an exciting trajectory in the folder. How the arm sags under gravity is then predicted from the "
            "masses of the URDF, usually from CAD",
        ),
        _stage(
            project,
            "Frequency responses",
            frequency,
            ("identify", "response", "robot.yaml", frequency or "", "--out", RESPONSES),
            RESPONSES,
            "no recordings of a frequency experiment in the folder. A compliance of the joints under gravity is then estimated from the "
            "measured poses, where they show it; under other loads and in motion it is not known so well",
        ),
        _stage(
            project,
            "Stiffness and damping",
            RESPONSES if (project.folder / RESPONSES / RESULTS).is_file() else None,
            ("identify", "stiffness", "robot.yaml", RESPONSES, "--out", STIFFNESS),
            STIFFNESS,
            "no frequency responses yet"
            if frequency
            else "no frequency experiment, hence no frequency responses. Stiffness is then known only as far as the measured poses show it",
        ),
        _stage(
            project,
            "Geometry",
            measured or None,
            ("calibrate", "robot.yaml", measured, "--out", CALIBRATION),
            CALIBRATION,
            f"no measured poses in the folder. Measure some (step 3), or put a table of them there as {MEASURED}",
        ),
    ]


def used_estimates(project: Project) -> str:
    """File of the estimates that robot.yaml names, relative to it; its default where robot.yaml cannot be read."""
    from flexcal.files.formats import read_yaml_file
    from flexcal.model.robot import RobotConfig

    try:
        return read_yaml_file(project.robot_file).structure(RobotConfig).estimates
    except FlexcalError:
        return RobotConfig.estimates


def use_estimates(project: Project, file: str) -> None:
    """Have robot.yaml name a file of estimates, which the following stages then begin with; raises `InputError` as `edit_robot`."""
    from flexcal.jobs.setup import edit_robot

    edit_robot(project.robot_file, {("estimates",): file})


def _stage(
    project: Project, title: str, data: str | None, arguments: tuple[str, ...], folder: str, reason: str
) -> Stage:
    done = (project.folder / folder / RESULTS).is_file()
    if not project.robot_file.is_file():
        return Stage(title, "blocked", "not yet: there is no robot.yaml (step 1, Robot).", arguments, folder)
    lacking = "no data" if folder == CALIBRATION else "optional, no data"
    if data is None:
        sentence = f"done, from data that are no longer here: {folder}" if done else f"{lacking}: {reason}."
        return Stage(title, "done" if done else "blocked", sentence, arguments, folder)
    if not done:
        return Stage(title, "ready", f"from {data}", arguments, folder)
    other = _difference(project, data) if folder == CALIBRATION else ""
    return Stage(title, "outdated" if other else "done", other or f"from {data}", arguments, folder)


def _difference(project: Project, measured: str) -> str:
    """How the measured poses of the result differ from a file of them; empty where it is fitted to that file as it is now."""
    folder = project.folder / CALIBRATION
    source = ResultSource.read(folder)
    if source is None or not (folder / ESTIMATES).is_file() or not (project.folder / measured).is_file():
        return "has a result, but of which poses cannot be read"
    if source.is_of(project.folder / measured):
        return ""
    if source.names_table(measured):
        return f"calibrated from {measured} as it was; it has changed since"
    return f"calibrated from {', '.join(source.tables) or 'other poses'}; {measured} is not in it"


def _plans(project: Project) -> dict[str, str]:
    """Kind of the plan in each folder of recordings."""
    found = {}
    for name in project.files("plan.yaml"):
        folder, _, file = name.rpartition("/")
        plan = read_plan_file(project.folder / name) if folder and file == "plan.yaml" else None
        if plan is not None:
            found[folder] = plan.kind
    return found
