"""STUDY.yaml: what runs, and with which options."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import YamlFile, provenance, read_yaml, read_yaml_file
from flexcal.files.structuring import StructureError
from flexcal.jobs.study.config import MOST_TASKS, CalibrateConfig, StudyConfig, TwoStageConfig
from flexcal.jobs.study.options import structured
from flexcal.jobs.study.resampled_calibrations import ResampledCalibrations
from flexcal.jobs.study.rows import StudyRow, combination_count, combinations, rows
from flexcal.jobs.study.tasks import StudyTasks
from flexcal.jobs.study.two_stage_runs import TwoStageRuns
from flexcal.jobs.study.virtual_calibrations import VirtualCalibrations
from flexcal.model.robot import RobotModel
from flexcal.printable import excerpt
from flexcal.virtual_cell import CellConfig


@dataclass(frozen=True)
class StudyPlan:
    """A study: its declaration, what its tasks have in common, and a row for each of them."""

    path: Path
    config: StudyConfig
    tasks: StudyTasks
    rows: tuple[StudyRow, ...]


def read_study(path: Path) -> StudyPlan:
    """Study of a file; robot and poses are looked for beside it.

    Raises `InputError` with the line for what the file declares wrongly: an unknown key, an option that there is not, a value that does not
    fit; and as reading the robot and its measurements does.
    """
    file = read_yaml_file(path)
    config: StudyConfig = file.structure(StudyConfig)  # type: ignore[arg-type]
    if not (path.parent / config.robot).is_file():
        raise file.error(
            "E-STUDY-030",
            ("robot",),
            f"there is no file {excerpt(config.robot)} beside it; correct the name.",
        )
    tasks = _tasks(path, config)
    _check_options(file, config, tasks)
    if isinstance(config, CalibrateConfig):
        seed = 0 if config.resampling is None else config.resampling.seed
        seeds = range(seed, seed + 1)
    else:
        seeds = range(config.seeds.first, config.seeds.first + config.seeds.count)
    count = combination_count(config) * len(seeds) * len(tasks.resamples)
    if count > MOST_TASKS:
        raise InputError(
            "E-STUDY-014", f"{path} declares {count} tasks; at most {MOST_TASKS} fit in a study."
        )
    chosen = list(combinations(config))
    for options in chosen:
        try:
            structured(options, tasks.options, tasks.cell)
        except FlexcalError as problem:
            given = ", ".join(f"{name}: {json.dumps(value)}" for name, value in options.items())
            raise InputError(problem.code, f"{path}: {problem} (with {given})") from problem
    planned = rows(chosen, seeds, tasks.resamples)
    different = {row.key: row for row in planned}
    return StudyPlan(path, config, tasks, tuple(different.values()))


def _tasks(path: Path, config: StudyConfig) -> StudyTasks:
    robot = path.parent / config.robot
    if isinstance(config, CalibrateConfig):
        return ResampledCalibrations.of(
            robot, [path.parent / name for name in config.poses], config.resampling
        )
    nominal = RobotModel.from_yaml(robot, estimates=False)
    declared, settings = robot.parent / "cell.yaml", {}
    if declared.exists():
        read_yaml(declared, CellConfig)
        settings = read_yaml_file(declared).data
    if isinstance(config, TwoStageConfig):
        return TwoStageRuns.of(robot, nominal, settings)
    sources = (robot, nominal.urdf, *([declared] if declared.exists() else []))
    return VirtualCalibrations(nominal, CollisionChecker(nominal), settings, provenance(sources))


def _check_options(file: YamlFile, config: StudyConfig, tasks: StudyTasks) -> None:
    """Raise `InputError` with the line of the first value that its option does not take."""
    for keys, name, value in _given(config):
        try:
            structured({name: value}, tasks.options, tasks.cell)
            tasks.require({name: value})
        except StructureError as problem:
            raise file.error(problem.code, keys, problem.failures[0].sentence) from problem
        except FlexcalError as problem:
            raise file.error(problem.code, keys, str(problem)) from problem
    for name, values in config.grid.items():
        if not values:
            raise file.error("E-STUDY-015", ("grid", name), f"the grid has no value of '{name}'; list some.")
    places = [config.options, config.grid, config.draw.options if config.draw else {}]
    for name in config.grid | (dict(places[2])):
        if sum(name in place for place in places) > 1:
            raise file.error(
                "E-STUDY-016", ("grid", name), f"'{name}' is given twice, in two of options, grid and draw."
            )


def _given(config: StudyConfig) -> Iterator[tuple[tuple[str | int, ...], str, Any]]:
    """Keys, option and value of everything that a study gives; of random numbers both limits."""
    for name, value in config.options.items():
        yield ("options", name), name, value
    for name, values in config.grid.items():
        for number, value in enumerate(values):
            yield ("grid", name, number), name, value
    drawn: Mapping[str, Any] = {} if config.draw is None else config.draw.options
    for name, how in drawn.items():
        for value in next(iter(vars(how).values())):
            yield ("draw", "options", name), name, value
