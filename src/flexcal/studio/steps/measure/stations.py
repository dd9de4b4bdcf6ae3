"""Stations of the instrument: which one the rows to come are of, and a new one where it was moved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.files.formats import read_yaml_file

if TYPE_CHECKING:
    from flexcal.jobs.guidance import MeasuredRows
    from flexcal.model.robot import RobotModel
    from flexcal.studio.steps.measure.series import Series

COLUMN = "station"


def current_station(series: Series, chosen: str) -> str:
    """Station of the rows to come: the `chosen` one where robot.yaml has it, else that of the last row."""
    names = series.model.stations.names
    if chosen in names:
        return chosen
    last = names[0] if series.poses is None else str(series.poses.station[-1])
    return last if last in names else names[0]


def new_station(series: Series, row: int, robot_file: Path, present: str) -> str:
    """Name for a new station of the rows from one on, which is not in use."""
    before = present if row >= len(series.rows) or series.poses is None else str(series.poses.station[row])
    used = set() if series.poses is None else set(series.poses.stations)
    declared = _declared(robot_file)
    # one that a change that was taken back has declared may be used
    taken = {*series.model.stations.names, *used} - {
        k for k, v in declared.items() if not v and k not in used
    }
    base, number = before.rstrip("0123456789") or before, 2
    while f"{base}{number}" in taken or f"{base}{number}" == before:
        number += 1
    return f"{base}{number}"


def declare_stations(robot_file: Path, model: RobotModel, names: Iterable[str]) -> list[str]:
    """Declare stations in robot.yaml that it lacks, beside those it has without saying so, and return the new ones.

    Raises `InputError` where robot.yaml cannot be changed.
    """
    from flexcal.jobs.setup import edit_robot

    new = [name for name in dict.fromkeys(names) if name not in model.stations.names]
    if new:
        declared = _declared(robot_file)
        every = [name for name in (*model.stations.names, *new) if name not in declared]
        edit_robot(robot_file, {("stations", name): {} for name in every})
    return new


def with_station(
    table: MeasuredRows, rows: Sequence[Mapping[str, str]], station: str, first: str
) -> list[dict[str, str]]:
    """Rows with the column of stations where the table has it: those without one are of `station`.

    A table without the column gets it where a row is of another station than `first`, of which its rows are.
    """
    columns = table.columns
    named = [{**cells, COLUMN: cells.get(COLUMN) or station} for cells in rows]
    if COLUMN in columns:
        return named
    if all(cells[COLUMN] == first for cells in named):
        return [dict(cells) for cells in rows] if not columns else [_without(cells) for cells in rows]
    if columns:
        table.move_station(len(table.rows()), "", first)
    return named


def _without(cells: Mapping[str, str]) -> dict[str, str]:
    return {name: cell for name, cell in cells.items() if name != COLUMN}


def _declared(robot_file: Path) -> dict[str, Any]:
    data = read_yaml_file(robot_file).data
    stations = data.get("stations") if isinstance(data, dict) else None
    return dict(stations) if isinstance(stations, dict) else {}
