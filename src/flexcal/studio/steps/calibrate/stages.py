"""The stages of a calibration, and what the project's files allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flexcal.errors import FlexcalError, InputError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.project import CALIBRATION, MEASURED, Project

INERTIALS, RESPONSES, STIFFNESS = "inertials", "responses", "stiffness"
"""Folders of results."""
State = Literal["done", "ready", "blocked"]


@dataclass(frozen=True)
class Stage:
    """A stage: identification of one part of the model.

    Parameters
    ----------
    title : str
        Its name on the button.
    state : {"done", "ready", "blocked"}
        Whether it has a result, can be run, or has no data.
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
            "no recordings of an exciting trajectory in the folder. Masses stay as the URDF has them, which suffices for most robots",
        ),
        _stage(
            project,
            "Frequency responses",
            frequency,
            ("identify", "response", "robot.yaml", frequency or "", "--out", RESPONSES),
            RESPONSES,
            "no recordings of a frequency experiment in the folder. The robot is then calibrated as rigid, with compliance under "
            "gravity where the poses show it",
        ),
        _stage(
            project,
            "Stiffness and damping",
            RESPONSES if (project.folder / RESPONSES / RESULTS).is_file() else None,
            ("identify", "stiffness", "robot.yaml", RESPONSES, "--out", STIFFNESS),
            STIFFNESS,
            "no frequency responses yet"
            if frequency
            else "no frequency experiment, hence no frequency responses",
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
        return Stage(title, "blocked", "blocked: no robot.yaml yet (step 1).", arguments, folder)
    if data is None:
        sentence = f"done, from data that are no longer here: {folder}" if done else f"blocked: {reason}."
        return Stage(title, "done" if done else "blocked", sentence, arguments, folder)
    return Stage(title, "done" if done else "ready", f"from {data}", arguments, folder)


def _plans(project: Project) -> dict[str, str]:
    """Kind of the plan in each folder of recordings."""
    from flexcal.data.plans import read_plan

    found = {}
    for name in project.files("plan.yaml"):
        folder, _, file = name.rpartition("/")
        if not folder or file != "plan.yaml":
            continue
        try:
            found[folder] = read_plan(project.folder / name).kind
        except (InputError, FlexcalError):
            continue
    return found
