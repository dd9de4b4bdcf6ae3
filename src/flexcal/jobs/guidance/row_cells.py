"""Rows of a table of measured poses as texts by column, and as poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.data.poses import DEFAULT_SIGMA, PoseSet
from flexcal.data.tables import Table, TableFile, assign, mapped_signals, standard_columns
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel

_TEXTS = ("target", "station")
_NUMBERS = (
    "sigma",
    "sigma_xyz",
    "payload",
    "temperature",
    "t",
    "tau",
    "quaternion",
    "sigma_angle",
    "force",
    "approach",
)


@dataclass(frozen=True)
class RowReader:
    """Reads rows of a table with these columns as poses of a robot, whatever their values: what they are worth is judged later."""

    path: Path
    columns: tuple[str, ...]
    model: RobotModel

    def __post_init__(self) -> None:
        mapped = mapped_signals(self.model)
        for quantity in ("q", "xyz"):
            own = standard_columns(quantity, self.model.n)
            other = mapped[quantity].columns if quantity in mapped else own
            if not {*own} <= {*self.columns} and not {*other} <= {*self.columns}:
                raise InputError(
                    "E-STUDIO-008",
                    f"{self.path} has no columns {', '.join(own)}; let 'flexcal import' read it once, which writes what the columns are.",
                )

    def poses(self, rows: Sequence[Mapping[str, str]]) -> PoseSet:
        """Poses of N rows; raises `InputError` for a cell that is no number, and an unknown target."""
        texts = [name for name in _TEXTS if name in self.columns]
        known = number_columns(self.model)
        read = [name for name in self.columns if name in known]
        file = TableFile(self.path, (*read, *texts), 1)
        arrays = {
            name: np.array([_number(self.path, k, name, row[name]) for k, row in enumerate(rows)])
            for name in read
        }
        arrays |= {name: np.array([row[name] for row in rows], dtype=str) for name in texts}
        table, count = Table(file, 1, arrays), len(rows)
        signals = assign(file, self.model, ("q", "xyz"), ("pose", *_NUMBERS), texts)
        values = {name: signal.values(table) for name, signal in signals.items()}
        sigma = values.get("sigma_xyz", values.get("sigma"))
        target = arrays.get("target", np.full(count, self.model.point().name))
        for name in dict.fromkeys(target.tolist()):
            self.model.point(name)
        return PoseSet(
            q=values["q"],
            position=values["xyz"],
            sigma=np.broadcast_to(DEFAULT_SIGMA if sigma is None else sigma, (count, 3)).copy(),
            torque=None,
            payload=values["payload"][:, 0] if "payload" in values else None,
            target=target,
            station=arrays.get("station", np.full(count, self.model.stations.names[0])),
            temperature=values["temperature"][:, 0] if "temperature" in values else None,
            time=values["t"][:, 0] if "t" in values else None,
            pose=values["pose"][:, 0].astype(int) if "pose" in values else np.arange(1, count + 1),
            approach=values.get("approach"),
            sigma_given=sigma is not None,
        )


def number_columns(model: RobotModel) -> set[str]:
    """Names of the columns of a robot's measured poses that hold numbers with a meaning."""
    known = {c for name in ("pose", "q", "xyz", *_NUMBERS) for c in standard_columns(name, model.n)}
    return known | {column for signal in mapped_signals(model).values() for column in signal.columns}


def in_columns(
    rows: Sequence[Mapping[str, str]], columns: Sequence[str], model: RobotModel
) -> list[dict[str, str]]:
    """Rows, texts by column, with the columns of a table that is there, as far as no measured number is made up or lost for it.

    The target, of a robot's first point, is added or left out, the number of the pose and the sides of approach left out, and remarks of
    the table are empty; sides that a table has are not known (0) of others.
    """
    if not columns:
        return [dict(cells) for cells in rows]
    first, numbers, sides = model.point().name, number_columns(model), standard_columns("approach", model.n)
    fitted = []
    for cells in rows:
        named = {"target": first, **cells}
        remarks = {name: "" for name in columns if name not in numbers and name not in _TEXTS}
        remarks |= {name: "0" for name in columns if name in sides}
        left_out = ("pose", *sides, *(("target",) if named["target"] == first else ()))
        fitted.append(remarks | {k: v for k, v in named.items() if k in columns or k not in left_out})
    return fitted


def cells_of(poses: PoseSet) -> list[dict[str, str]]:
    """Texts by column of every row of poses, numbers such that they come back bit by bit."""
    n = poses.q.shape[1]
    numbers = {name: poses.q[:, k] for k, name in enumerate(standard_columns("q", n))}
    numbers |= {name: poses.position[:, k] for k, name in enumerate("xyz")}
    if poses.approach is not None:
        numbers |= {name: poses.approach[:, k] for k, name in enumerate(standard_columns("approach", n))}
    if poses.sigma_given:
        numbers |= {name: poses.sigma[:, k] for k, name in enumerate(standard_columns("sigma_xyz", n))}
    for name, values in (("payload", poses.payload), ("temperature", poses.temperature), ("t", poses.time)):
        if values is not None:
            numbers[name] = values
    return [
        {"pose": str(int(poses.pose[k]))}
        | {name: repr(float(values[k])) for name, values in numbers.items()}
        | {"target": str(poses.target[k]), "station": str(poses.station[k])}
        for k in range(len(poses))
    ]


def _number(path: Path, row: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(
            "E-STUDIO-009", f"{path}, row {row + 1}, column {column}: '{cell}' is not a number; correct it."
        )
    return value
