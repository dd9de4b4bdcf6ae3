"""All that is wrong in a robot.yaml and its URDF, each at its line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import Place, YamlFile, read_yaml_file, yaml_nodes
from flexcal.files.structuring import Keys, StructureError, structure
from flexcal.files.transaction import read_bytes
from flexcal.model.robot import RobotConfig, RobotModel, read_robot

_INDEPENDENT = (
    "controller",
    "drives",
    "dynamics",
    "elastic",
    "force_sensor",
    "geometry",
    "limits",
    "measurements",
    "payload",
    "points",
    "sensors",
    "signals",
    "stations",
)
"""Blocks without which the rest of the file means the same."""


@dataclass(frozen=True)
class FileProblem:
    """Fault of `path` at `line` and `column`, from 1: code and sentence of the error, the sentence without the place."""

    path: Path
    line: int
    column: int
    code: str
    sentence: str


def description_problems(robot_file: Path) -> list[FileProblem]:
    """Everything wrong in robot.yaml and its URDF, in the order of the lines; empty for a robot that can be read.

    A file that is not YAML has one problem, its first. Of keys, types and values of robot.yaml all are found. Only where these are right is
    the robot made: of the URDF the first problem is found, and of what does not go with the URDF one for every point, sensor and other
    entry, as far as leaving it out does not change what the rest means. Stored estimates are not looked at.
    """
    try:
        file = read_yaml_file(robot_file)
    except InputError as problem:
        return [_placed(problem, robot_file, {})]
    places = yaml_nodes(read_bytes(robot_file).decode("utf-8-sig")).places()
    try:
        structure(file.data, RobotConfig)
    except StructureError as problem:
        found = []
        for failure in problem.failures:
            place = _nearest(places, failure.keys)
            found.append(FileProblem(robot_file, place.line, place.column, failure.code, failure.sentence))
        return sorted(found, key=lambda item: (item.line, item.column))
    return sorted(
        _of_the_robot(file, places), key=lambda item: (item.path != robot_file, item.line, item.column)
    )


def _of_the_robot(file: YamlFile, places: Mapping[Keys, Place]) -> list[FileProblem]:
    """Problems of what does not go with the URDF: what has one is left out, and the rest is tried again."""
    found: list[FileProblem] = []
    points_left_out = False
    while True:
        try:
            read_robot(RobotModel, file)
            return found
        except FlexcalError as problem:
            item = _placed(problem, file.path, places)
        keys = _keys_at(file, item)
        block = str(keys[0]) if keys else ""
        if block == "elastic" and points_left_out and "points" in file.data:
            # that no point is beyond a joint may be due to those left out
            file = replace(file, data=_without(file.data, "points", None))
            continue
        found.append(item)
        if block not in _INDEPENDENT or item.path != file.path:
            return found
        points_left_out |= block == "points"
        file = replace(file, data=_without(file.data, block, keys[1] if len(keys) > 1 else None))


def _keys_at(file: YamlFile, item: FileProblem) -> Keys:
    """Longest keys on the line of a problem."""
    return max((keys for keys, line in file.lines.items() if line == item.line), key=len, default=())


def _without(data: Any, block: str, name: str | int | None) -> Any:
    """Data without the named entry of a block, or without a block that is a list or has no entries with names."""
    named = block in ("points", "sensors", "stations", "measurements", "signals")
    if named and name in data[block] and len(data[block]) > 1:
        return data | {block: {key: item for key, item in data[block].items() if key != name}}
    return {key: item for key, item in data.items() if key != block}


def _placed(problem: FlexcalError, path: Path, places: Mapping[Keys, Place]) -> FileProblem:
    """Problem of an error whose sentence begins with file and line."""
    sentence = str(problem)
    match = re.match(r"(?P<path>.+?)(?: line (?P<line>\d+)(?:, column (?P<column>\d+))?)?: ", sentence)
    if match is None or not match["line"]:
        place = places.get(("robot",), Place(0, 1, 1))
        return FileProblem(path, place.line, place.column, problem.code, sentence)
    line = int(match["line"])
    of_urdf = Path(match["path"]) != path
    columns = [] if of_urdf else [place.column for place in places.values() if place.line == line]
    column = int(match["column"]) if match["column"] else min(columns, default=1)
    return FileProblem(Path(match["path"]), line, column, problem.code, sentence[match.end() :])


def _nearest(places: Mapping[Keys, Place], keys: Keys) -> Place:
    while keys and keys not in places:
        keys = keys[:-1]
    return places.get(keys, Place(0, 1, 1))
