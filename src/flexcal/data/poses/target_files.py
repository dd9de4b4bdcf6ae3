"""Tool targets on disk: CSV or Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import (
    approach_columns,
    first_point,
    payload_column,
    target_column,
    unit_quaternions,
    whole_numbers,
    without_ways,
)
from flexcal.data.poses.length_units import unit_advice
from flexcal.data.poses.tool_targets import ToolTargets
from flexcal.data.tables import (
    Table,
    TableFile,
    assign,
    check_joint_units,
    mapped_signals,
    open_table,
    standard_columns,
    write_table,
)
from flexcal.model.parts import rotation_wxyz, wxyz_rotation

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_DISTANCES = (0.12, 1.3)
"""Usual distance of targets from the base, relative to the robot's reach."""
OF_COMMANDS = ("target", "unambiguous")
"""Columns of motor commands that are no numbers."""


def read_targets(path: str | Path, model: RobotModel) -> ToolTargets:
    r"""Read targets of the tool.

    Parameters
    ----------
    path : str or Path
        Table with `pose` and joint positions q1…qn (rad or m), or points x, y, z (m) and optionally qw, qx, qy, qz, or both;
        `target`, `station`, `payload` (kg), `temperature` (°C) and `approach1`… are optional.
    model : RobotModel
        Robot whose joints, points and stations the columns name.

    Returns
    -------
    ToolTargets
        One target a row.

    Raises
    ------
    InputError
        With file, line and column, for a missing, unknown or partial column, a value that is missing or no number, angles
        that cannot be in rad, points that cannot be in m, an unknown target or station, a pose number that stands twice, a
        negative payload and a quaternion that is not of unit norm.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from flexcal import RobotModel, read_targets
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "targets.csv"
    ...     _ = file.write_text("pose,x,y,z\n1,0.4,0.1,0.3\n2,0.4,-0.1,0.3\n")
    ...     targets = read_targets(file, model)
    >>> targets.position
    array([[ 0.4,  0.1,  0.3],
           [ 0.4, -0.1,  0.3]])
    """
    file = without_ways(open_table(path), model)
    texts = tuple(name for name in ("target", "station") if name in file.columns)
    signals = assign(
        file, model, ("pose",), ("q", "xyz", "quaternion", "payload", "temperature", "approach"), texts
    )
    if "q" not in signals and "xyz" not in signals:
        raise file.error(
            "E-POSES-027",
            f"there are no target positions; add x, y, z, or q1…q{model.n} of the nominal command.",
        )
    for name in ("quaternion", "station"):
        if (name in signals or name in texts) and "xyz" not in signals:
            raise file.error("E-POSES-028", f"there is '{name}' but no x, y, z; add them, or remove it.")
    table = file.read(texts)
    values = {name: signal.values(table) for name, signal in signals.items()}
    if "q" in values:
        check_joint_units(model, table, signals["q"], values["q"])
    if "xyz" in values and "station" not in texts:
        _check_metres(table, signals["xyz"].columns, values["xyz"], model.reach)
    if "station" in texts:
        _check_stations(table, model)
    pose = whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0])
    quaternion = (
        unit_quaternions(table, signals["quaternion"], values["quaternion"])
        if "quaternion" in values
        else None
    )
    targets = ToolTargets(
        pose=pose,
        target=_points(file, table, model),
        q=values.get("q"),
        position=values.get("xyz"),
        rotation=None if quaternion is None else wxyz_rotation(quaternion),
        station=table.columns["station"] if "station" in texts else None,
        payload=payload_column(table, signals, model),
        temperature=values["temperature"][:, 0] if "temperature" in values else None,
        approach=approach_columns(table, signals),
    )
    _check_once(table, pose)
    return targets


def write_commands(
    path: str | Path, model: RobotModel, commands: ToolTargets, unambiguous: np.ndarray, like: TableFile
) -> None:
    """Write motor commands as CSV or Parquet: `pose`, q1…qn, `target`, `payload`, `temperature` and `approach1`… where given,
    `unambiguous` (N,).

    Where the file `like` has the columns that `signals:` maps to q, the commands stand in these, in their units. Raises `InputError`
    where the mapping has no inverse.
    """
    mapped = mapped_signals(model).get("q")
    columns = _columns(commands)
    if mapped is not None and commands.q is not None and set(mapped.columns) <= set(like.columns):
        own = standard_columns("q", model.n)
        kept = {name: values for name, values in columns.items() if name not in own}
        columns = {"pose": kept.pop("pose")} | mapped.columns_of(commands.q) | kept
    write_table(path, columns | {"unambiguous": unambiguous})


def read_commands(path: str | Path, model: RobotModel) -> ToolTargets:
    """Read motor commands: `pose`, q1…qn, and where given `target`, `payload`, `temperature` and `approach1`…; not `unambiguous`.

    Raises `InputError` as `read_targets` does.
    """
    file = without_ways(open_table(path), model)
    texts = tuple(name for name in OF_COMMANDS if name in file.columns)
    signals = assign(file, model, ("pose", "q"), ("payload", "temperature", "approach"), texts)
    table = file.read(texts)
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    pose = whole_numbers(table, signals["pose"].columns[0], signals["pose"].values(table)[:, 0])
    _check_once(table, pose)
    return ToolTargets(
        pose,
        _points(file, table, model),
        q,
        payload=payload_column(table, signals, model),
        temperature=signals["temperature"].values(table)[:, 0] if "temperature" in signals else None,
        approach=approach_columns(table, signals),
    )


def write_targets(path: str | Path, targets: ToolTargets) -> None:
    """Write targets as CSV or Parquet, with the columns that `read_targets` reads."""
    write_table(path, _columns(targets))


def _columns(targets: ToolTargets) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {"pose": targets.pose}
    turn = None if targets.rotation is None else rotation_wxyz(targets.rotation)
    vectors = {"q": targets.q, "xyz": targets.position, "quaternion": turn, "approach": targets.approach}
    for quantity, values in vectors.items():
        if values is not None:
            names = standard_columns(quantity, values.shape[1])
            columns |= {name: values[:, i] for i, name in enumerate(names)}
    others = {name: getattr(targets, name) for name in ("target", "station", "payload", "temperature")}
    return columns | {name: values for name, values in others.items() if values is not None}


def _points(file: TableFile, table: Table, model: RobotModel) -> np.ndarray:
    if "target" in file.columns:
        return target_column(table, model)
    return np.full(len(table), first_point(file, model))


def _check_once(table: Table, pose: np.ndarray) -> None:
    first = np.unique(pose, return_index=True)[1]
    if len(first) < len(pose):
        row = int(np.setdiff1d(np.arange(len(pose)), first)[0])
        raise table.error(
            "E-POSES-029", row, "pose", f"{pose[row]} stands twice; give every target its own number."
        )


def _check_stations(table: Table, model: RobotModel) -> None:
    for row, name in enumerate(table.columns["station"].tolist()):
        if name not in model.stations.names:
            known = ", ".join(model.stations.names)
            raise table.error(
                "E-POSES-030", row, "station", f"there is no station '{name}' in robot.yaml; it has {known}."
            )


def _check_metres(table: Table, columns: tuple[str, ...], position: np.ndarray, reach: float) -> None:
    """Raise `InputError` for the first point that lies ten times farther from the base than the robot reaches."""
    distance = np.linalg.norm(position, axis=1)
    if (distance > 10 * reach).any():
        row = int(np.argmax(distance > 10 * reach))
        middle = float(np.median(distance))
        near = unit_advice(middle, *(share * reach for share in _DISTANCES)) if middle > 10 * reach else ""
        advice = near or "correct or remove the line."
        place = (
            f"the point lies {distance[row]:.4g} m from the robot's base, but the robot reaches {reach:.3g} m"
        )
        raise table.error(
            "E-POSES-031", row, columns[int(np.argmax(np.abs(position[row])))], f"{place}; {advice}"
        )
