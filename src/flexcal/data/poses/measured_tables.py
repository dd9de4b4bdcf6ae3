"""Measured poses on disk: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.camera_tables import CAMERA_COLUMNS, measures_images, read_views
from flexcal.data.poses.candidate_pool import PosePool
from flexcal.data.poses.checks import check_metres, check_motion, check_same_pose
from flexcal.data.poses.columns import (
    approach_columns,
    check_noise,
    first_point,
    payload_column,
    target_column,
    unit_quaternions,
    whole_numbers,
    without_ways,
)
from flexcal.data.poses.distance_tables import (
    LENGTH,
    READING,
    TOUCHED,
    WIRE,
    measures_distances,
    read_distances,
)
from flexcal.data.poses.excluded_rows import EXCLUDED, without_excluded
from flexcal.data.poses.image_folders import tables_of
from flexcal.data.poses.moving_base import BASE, seen_from_base
from flexcal.data.poses.pose_set import DEFAULT_SIGMA, PLANE, PoseSet, concatenate
from flexcal.data.poses.socket_tables import HOLDER, SOCKET_COLUMNS, measures_sockets, read_sockets
from flexcal.data.poses.tilt_tables import INCLINOMETER, measures_tilts, read_tilts
from flexcal.data.tables import (
    UNITS,
    TableFile,
    assign,
    check_joint_limits,
    check_joint_units,
    open_table,
    standard_columns,
    timestamp_columns,
    with_seconds,
    write_table,
)
from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_NUMBERS = (
    "quaternion", "sigma", "sigma_xyz", "sigma_angle", "tau", "payload", "force", "approach", "temperature", "t", *BASE,
)  # fmt: skip
_TEXTS = ("target", "station")
_TEXT_COLUMNS = (*_TEXTS, *SOCKET_COLUMNS, HOLDER, *CAMERA_COLUMNS, WIRE, TOUCHED, INCLINOMETER)
"""All columns of texts, of whatever kind of measurement."""
_MISSPELT = 0.7
"""Likeness of a column's name to a known one from which it is that, misspelt."""


def read_poses(
    paths: str | Path | Sequence[str | Path],
    model: RobotModel,
    *,
    require_motion: bool = True,
    further: Sequence[str] = (),
) -> PoseSet:
    """Read measured poses from one file or several, joined in order (see `concatenate`).

    Parameters
    ----------
    paths : str or Path, or sequence of these
        CSV or Parquet tables with the columns q1…qn (rad or m) and x, y, z (m). Without a column `target` the point is
        the first under `points:`; without `station` the instrument stands at the robot's first station; without `sigma` it is
        0.1 mm and `sigma_given` is False. A file with `fixture`, `socket` and q1…qn has a ball on the tool in sockets, as declared
        under `measurements:`, at places of the fixture that are not known; one with `length` those of a draw-wire, one with `touched`
        contacts with a plane, line or sphere, one with `image` a camera's views of a board. A folder of images stands for its table.
    model : RobotModel
        Robot whose joints, points and stations the columns name.
    require_motion : bool
        Whether poses that are all equal, and joints that never move, are refused: nothing can be calibrated from them.
    further : sequence of str
        Names of columns that may be there beside those above, and are not used.

    Returns
    -------
    PoseSet
        One row per pose and target, in measuring order.

    Raises
    ------
    InputError
        With file, line and column, for a missing, unknown or partial column, a value that is missing or no number, angles
        that cannot be in rad, points that cannot be in m, an unknown target, a negative sigma or payload, a quaternion that
        is not of unit norm, and joint positions that differ within one pose.

    Examples
    --------
    >>> from flexcal import RobotModel, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml")
    >>> poses = read_poses("examples/ur5_tracker/random.csv", model)
    >>> poses.q.shape, poses.position.shape
    ((20, 6), (20, 3))
    """
    listed = tables_of([paths] if isinstance(paths, str | Path) else list(paths))
    return _joined([_read(path, model, tuple(further)) for path in listed], listed, model, require_motion)


def read_grouped_poses(paths: Sequence[Path], model: RobotModel, column: str) -> tuple[PoseSet, np.ndarray]:
    """Poses as `read_poses` reads them, and the texts (N,) of a `column` that groups them.

    Raises `InputError` as `read_poses` does, and for a file without the column.
    """
    listed = tables_of(paths)
    labels = [_labels(path, column) for path in listed]
    sets = [_read(path, model, (column,)) for path in listed]
    kept = [_of_views(path, own, poses) for path, own, poses in zip(listed, labels, sets, strict=True)]
    return _joined(sets, listed, model, True), np.concatenate(kept)


def _joined(sets: Sequence[PoseSet], listed: Sequence[Path], model: RobotModel, moving: bool) -> PoseSet:
    poses, where = concatenate(sets), " and ".join(str(path) for path in listed)
    _check_cameras(poses, where)
    if moving:
        check_motion(poses, model, where)
    return poses


def _check_cameras(poses: PoseSet, where: str) -> None:
    """Raise `InputError` where a camera, or its board, is said to be the point that something else measures."""
    shared = [name for name in poses.targets if len(set(poses.seen[poses.target == name].tolist())) > 1]
    if shared:
        raise InputError(
            "E-POSES-068",
            f"{where}: the point {shared[0]} is measured by a camera and by something else, but a camera's point is the camera itself, or "
            "the board on the hand; add it under `points:` with the camera's name.",
        )


def read_pose_pool(path: str | Path, model: RobotModel) -> PosePool:
    """Read poses to choose from: `pose`, `q1`… and, where all hold the same one, `payload`; what was measured in them is not used.

    Rows of one pose count once. Raises `InputError` with file, line and column as `read_poses` does, for a pose outside the joint
    limits, and for payloads that differ.
    """
    file, _ = without_excluded(open_table(path))
    file = without_ways(file, model)
    texts = tuple(name for name in _TEXTS if name in file.columns)
    signals = assign(file, model, ("pose", "q"), (*_NUMBERS, "xyz", "length"), texts)
    stamps = timestamp_columns(signals)
    (table,) = with_seconds([file.read((*texts, *stamps))], stamps)
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    columns = [signals["q"].column_of(joint) for joint in range(model.n)]
    check_joint_limits(model, table, np.arange(len(q)), columns, q)
    pose = whole_numbers(table, signals["pose"].columns[0], signals["pose"].values(table)[:, 0])
    check_same_pose(pose, q, table)
    first = np.sort(np.unique(pose, return_index=True)[1])
    payload = payload_column(table, signals, model)
    if payload is not None and np.ptp(payload) > 0:
        row = int(np.argmax(payload != payload[0]))
        sentence = (
            f"{payload[row]:g} kg follow {payload[0]:g} kg; choose from poses with one payload at a time."
        )
        raise table.error("E-POSES-015", row, signals["payload"].columns[0], sentence)
    return PosePool(q[first], pose[first], None if payload is None else float(payload[0]))


def write_poses(path: str | Path, poses: PoseSet) -> None:
    """Write poses as CSV or Parquet by the file's suffix, atomically, under the standard columns in SI units."""
    columns: dict[str, np.ndarray] = {"pose": poses.pose}
    vectors = [("q", poses.q)]
    read = _read_by_one(path, poses)
    if read:
        columns |= dict(read)
    else:
        vectors.append(("xyz", poses.position))
    if poses.quaternion_wxyz is not None:
        vectors.append(("quaternion", poses.quaternion_wxyz))
    if poses.orientation_sigma is not None:
        vectors.append(("sigma_angle", poses.orientation_sigma[:, None]))
    if poses.sigma_given:
        vectors.append(("sigma", poses.sigma[:, :1]) if read else ("sigma_xyz", poses.sigma))
    if poses.force is not None:
        vectors.append(("force", poses.force))
    if poses.torque is not None:
        vectors.append(("tau", poses.torque))
    if poses.approach is not None:
        vectors.append(("approach", poses.approach))
    for quantity, values in vectors:
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values).all(axis=1)))
            raise InputError(
                "E-POSES-016",
                f"{path}: {quantity} of row {row + 1} is not finite, so the poses are not written.",
            )
        names = standard_columns(quantity, poses.q.shape[1])
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    for name in ("payload", "target", *(() if read else ("station",)), "temperature"):
        values = getattr(poses, name)
        if values is not None:
            columns[name] = values
    if poses.time is not None:
        columns["t"] = poses.time
    write_table(path, columns)


def _read_by_one(path: str | Path, poses: PoseSet) -> Mapping[str, np.ndarray]:
    """Columns of lengths or touches; empty for points. Raises `InputError` where there are several of these."""
    if poses.kind is None:
        return {}
    wires = poses.far & (poses.position[:, 0] > 0)
    if wires.all():
        return {LENGTH: poses.position[:, 0], WIRE: poses.station}
    if wires.any() or poses.located.any():
        raise InputError("E-POSES-062", f"{path}: write points, lengths and touches to a file each.")
    return {TOUCHED: poses.station, READING: np.where(poses.kind == PLANE, poses.position[:, 2], 0.0)}


def _labels(path: Path, column: str) -> np.ndarray:
    """Texts (rows,) of one column of a table; raises `InputError` for a file without it."""
    file, _ = without_excluded(open_table(path))
    if column not in file.columns:
        raise file.error("E-POSES-041", f"there is no column '{column}' by which to hold out measurements.")
    if column == EXCLUDED:
        raise file.error(
            "E-POSES-081", f"the rows that are used have nothing in '{EXCLUDED}'; hold out by another column."
        )
    others = [*file.unread, *(name for name in file.text_columns() if name != column)]
    return file.leaving_out(others).read((column,)).columns[column]


def _of_views(path: Path, labels: np.ndarray, poses: PoseSet) -> np.ndarray:
    """Labels (N,) of the measurements of a file from those of its rows, of which a view has several, and views left out none."""
    if not poses.seen.any():
        return labels
    file, _ = without_excluded(open_table(path))
    others = [*file.unread, *(name for name in file.text_columns() if name != "pose")]
    numbers = file.leaving_out(others).read().columns["pose"].astype(np.int64)
    first = dict(zip(reversed(numbers.tolist()), reversed(labels.tolist()), strict=True))
    return np.array([first[number] for number in poses.pose.tolist()])


def _named_texts(file: TableFile, further: Sequence[str]) -> tuple[str, ...]:
    """Columns of a file that hold texts, beside the `further` ones."""
    named = (*_TEXT_COLUMNS, *further)
    return tuple(dict.fromkeys(name for name in named if name in file.columns))


def _read(path: Path, model: RobotModel, further: tuple[str, ...]) -> PoseSet:
    file, excluded = without_excluded(open_table(path))
    file = without_ways(file, model)
    # a quantity of the file is read as such, even if its values group the measurements
    quantities = {column for name in (*UNITS, "pose") for column in standard_columns(name, model.n)}
    quantities |= {column for signal in model.config.signals.values() for column in signal.columns}
    further = tuple(name for name in further if name not in quantities)
    known = {*quantities, *model.joint_names, *_named_texts(file, further), *_TEXT_COLUMNS, EXCLUDED}
    remarks = _remarks(file, known)
    poses = _read_kind(file.leaving_out(remarks), model, further)
    if remarks:
        excluded = (*excluded, f"{path.name}: the texts in {', '.join(remarks)} are not used")
    return replace(poses, notes=(*poses.notes, *excluded)) if excluded else poses


def _remarks(file: TableFile, known: Collection[str]) -> list[str]:
    """Columns of texts that are none of the `known` ones; raises `InputError` for one whose name is nearly that of a known one."""
    texts = [name for name in file.text_columns() if name not in known]
    for name in texts:
        if near := get_close_matches(name, sorted(known), n=1, cutoff=_MISSPELT):
            raise file.error(
                "E-POSES-074",
                f"the column '{name}' is not known, and nearly called '{near[0]}': call it so, or, if it is a remark, otherwise.",
            )
    return texts


def _read_kind(file: TableFile, model: RobotModel, further: tuple[str, ...]) -> PoseSet:
    """Measurements of the kind that the columns of a file tell."""
    if measures_sockets(file):
        return read_sockets(file, model, further)
    if measures_images(file):
        return read_views(file, model, further)
    if measures_tilts(file, model):
        return read_tilts(file, model, further)
    if measures_distances(file, model):
        return read_distances(file, model, further)
    texts = tuple(dict.fromkeys(name for name in (*_TEXTS, *further) if name in file.columns))
    _check_measured(file, model)
    signals = assign(file, model, ("pose", "q", "xyz"), _NUMBERS, texts)
    if "sigma" in signals and "sigma_xyz" in signals:
        raise file.error("E-POSES-017", "sigma and sigma_x, sigma_y, sigma_z are both there; keep one.")
    stamps = timestamp_columns(signals)
    (table,) = with_seconds([file.read((*texts, *stamps))], stamps)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    rows = len(table)
    sigma = values.get("sigma_xyz", values.get("sigma"))
    for name, measured in (("sigma", "xyz"), ("sigma_xyz", "xyz"), ("sigma_angle", "quaternion")):
        if name in values:
            check_noise(table, signals[name], values[name], values.get(measured, values["xyz"]))
    target = target_column(table, model) if "target" in texts else np.full(rows, first_point(file, model))
    station = table.columns["station"] if "station" in texts else np.full(rows, _first_station(model))
    poses = PoseSet(
        q=values["q"],
        position=values["xyz"],
        sigma=np.broadcast_to(DEFAULT_SIGMA if sigma is None else sigma, (rows, 3)).copy(),
        torque=values.get("tau"),
        payload=payload_column(table, signals, model),
        target=target,
        station=station,
        temperature=values["temperature"][:, 0] if "temperature" in values else None,
        time=values["t"][:, 0] if "t" in values else None,
        pose=whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0]),
        quaternion_wxyz=unit_quaternions(table, signals["quaternion"], values["quaternion"])
        if "quaternion" in values
        else None,
        orientation_sigma=values["sigma_angle"][:, 0] if "sigma_angle" in values else None,
        force=values.get("force"),
        approach=approach_columns(table, signals),
        sigma_given=sigma is not None,
    )
    check_same_pose(poses.pose, poses.q, table)
    poses = seen_from_base(poses, table, signals, values, model)
    check_metres(poses, model, table, signals["xyz"])
    return poses


def _check_measured(file: TableFile, model: RobotModel) -> None:
    """Raise `InputError` where a file is evidently another program's, or a plan that is still to be measured."""

    def there(quantity: str) -> bool:
        mapped = model.config.signals
        named = mapped[quantity].columns if quantity in mapped else ()
        return not {*standard_columns(quantity, model.n), *named}.isdisjoint(file.columns)

    if not there("q") and "pose" not in file.columns:
        raise file.error(
            "E-POSES-019",
            f"there is no column pose, nor q1 … q{model.n}; 'flexcal import' makes such a file of one with other columns.",
        )
    if there("q") and not there("xyz"):
        raise file.error(
            "E-POSES-020",
            "there are joint positions, but no measured points x, y, z; measure these poses, and convert the measurements with "
            "'flexcal import'.",
        )


def _first_station(model: RobotModel) -> str:
    return model.stations.names[0]
