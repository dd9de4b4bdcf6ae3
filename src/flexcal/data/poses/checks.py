"""Checks of measured poses: plausible positions, and motion of every joint."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.length_units import unit_advice, unit_of_ratio
from flexcal.data.poses.pose_set import PoseSet
from flexcal.data.tables import Signal, Table
from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_ALIKE = 1.5
"""Factor by which the extent of measured points differs from that of the nominal robot's at the same poses, at most."""
_POSSIBLE = (0.02, 1.3)
"""Extent of the points or distances of all poses about their middle, relative to the robot's reach, where the nominal one tells nothing."""
_ANOTHER_SIZE = 1.5
"""Size of a figure of points, relative to the nominal robot's at the same poses, from which its unit is looked for."""
_SAME_SHAPE = 0.25
"""Root mean square by which figures of one shape differ, relative to their size: by errors of the robot and the place of its target."""
_FEWEST, _MOST = 4, 200
"""Rows of a station and target whose figure is compared."""
STILL = 1e-3
"""Range over all poses (rad or m) below which a joint counts as never moving."""
SAME_POSE = 0.02
"""Largest difference of joint positions (rad or m) between rows of one pose."""


def check_motion(poses: PoseSet, model: RobotModel, where: str) -> None:
    """Raise `InputError` where there is one pose only, all are equal, or a joint never moves; `where` names the files."""
    if len(np.unique(poses.pose)) < 2:
        raise InputError(
            "E-POSES-003", f"{where}: there is one pose only; measure more poses, in which every joint moves."
        )
    travel = np.ptp(poses.q, axis=0)
    if (travel < STILL).all():
        raise InputError(
            "E-POSES-004",
            f"{where}: all poses are equal (columns q1…q{len(travel)}); measure poses in which every joint moves.",
        )
    still = np.flatnonzero(travel < STILL)
    if len(poses.pointed) < len(poses):
        # an inclinometer is of use while single joints move
        pointing = {i for name in poses.pointed.targets for i in model.path_to(model.point(name).joint)}
        still = np.array([i for i in still if model.motors[i] in pointing])
    if still.size:
        listed = ", ".join(f"{model.motor_names[i]} (column q{i + 1})" for i in still)
        word = "joints never move" if still.size > 1 else "joint never moves"
        raise InputError(
            "E-POSES-005",
            f"{where}: the {word}: {listed}; add poses in which all joints take different angles.",
        )


def check_same_pose(pose: np.ndarray, q: np.ndarray, table: Table) -> None:
    """Raise `InputError` with the row where a `pose` (N,) has other joint positions `q` (N, n) than in its first row."""
    numbers, first, inverse = np.unique(pose, return_index=True, return_inverse=True)
    differs = np.abs(q - q[first[inverse]]) > SAME_POSE
    if differs.any():
        row, joint = (int(i) for i in np.argwhere(differs)[0])
        original = int(first[inverse[row]])
        raise table.error(
            "E-POSES-006",
            row,
            f"q{joint + 1}",
            f"pose {numbers[inverse[row]]} stands at {q[row, joint]:g} here, but at {q[original, joint]:g} "
            f"in {table.file.row_word} {table.number_of(original)}; give every pose its own number.",
        )


def _nominal_extent(poses: PoseSet, model: RobotModel) -> float | None:
    """Median distance, m, of the nominal robot's points from the middle of those of their station and target; None where it has none."""
    from flexcal.model.kinematics import point_kinematics

    known = set(model.points)
    if poses.kind is not None or not known.issuperset(poses.targets):
        return None
    extent = np.zeros(len(poses))
    for target in poses.targets:
        seen = poses.target == target
        position = point_kinematics(model, poses.q[seen], point=target).position
        for station in poses.stations:
            rows = poses.station[seen] == station
            if rows.any():
                own = position[rows]
                extent[np.flatnonzero(seen)[rows]] = np.linalg.norm(own - np.median(own, axis=0), axis=1)
    return float(np.median(extent))


def _check_size(poses: PoseSet, model: RobotModel, table: Table, signal: Signal) -> None:
    """Raise `InputError` where the points of a station and target have the shape of the nominal robot's at the same poses in the size of
    another unit.
    """
    from flexcal.model.kinematics import point_kinematics

    if poses.kind is not None or not set(model.points).issuperset(poses.targets):
        return
    for station in poses.stations:
        for target in poses.targets:
            rows = np.flatnonzero(
                (poses.station == station) & (poses.target == target) & poses.present.all(axis=1)
            )
            if len(rows) < _FEWEST:
                continue
            rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), _MOST)).astype(int)]
            nominal = point_kinematics(model, poses.q[rows], point=target, jacobians=False).position
            ratio, left = _similarity(nominal, poses.position[rows])
            advice = unit_of_ratio(ratio) if max(ratio, 1 / ratio) > _ANOTHER_SIZE else ""
            if advice and left < _SAME_SHAPE:
                raise table.error(
                    "E-POSES-082",
                    int(rows[0]),
                    signal.column_of(0),
                    f"the points lie as this robot's do, but {ratio:.4g} times as far apart; {advice}",
                )


def _similarity(nominal: np.ndarray, measured: np.ndarray) -> tuple[float, float]:
    """Size of the figure of `measured` points (N, 3) over that of the `nominal` ones, and what remains of it after the best fit of place,
    rotation and size (Umeyama 1991), relative.
    """
    a, b = nominal - nominal.mean(axis=0), measured - measured.mean(axis=0)
    u, stretch, vt = np.linalg.svd(a.T @ b)
    stretch[-1] *= np.sign(np.linalg.det(u @ vt))
    whole, own = float((b**2).sum()), float((a**2).sum())
    if whole <= 0 or own <= 0 or stretch.sum() <= 0:
        return 1.0, 1.0
    return float(stretch.sum() / own), float(np.sqrt(max(whole - stretch.sum() ** 2 / own, 0.0) / whole))


def check_metres(poses: PoseSet, model: RobotModel, table: Table, signal: Signal) -> None:
    """Raise `InputError` where points cannot be in m.

    The points of one target seen from one station lie within twice the robot's reach of each other, and the instrument
    stands no farther than ten times the reach (at least 60 m) away: what lies beyond twice that is refused. So are points that are the
    robot's in the size of another unit, as feet, which are not too far away for that.
    """
    reach = float(model.reach)
    values = poses.position if poses.kind is None else poses.position[:, :1]
    distance = np.linalg.norm(values, axis=1)
    spread = np.zeros(len(poses))
    for station in poses.stations:
        for target in poses.targets:
            rows = (poses.station == station) & (poses.target == target)
            if rows.any():
                spread[rows] = np.linalg.norm(values[rows] - np.median(values[rows], axis=0), axis=1)
    farthest = max(10 * reach, 60.0)
    wrong = (spread > 4 * reach) | (distance > farthest)
    if not wrong.any():
        _check_size(poses, model, table, signal)
        return
    row = int(np.argmax(wrong))
    column = signal.column_of(int(np.argmax(np.abs(values[row]))))
    place = f"the point lies {distance[row]:.4g} m from the instrument and {spread[row]:.4g} m from the middle of all points"
    many = wrong.sum() > 0.2 * wrong.size
    extent, nominal = float(np.median(spread)), _nominal_extent(poses, model)
    advice = unit_advice(extent, nominal / _ALIKE, nominal * _ALIKE) if many and nominal else ""
    if many and not advice:
        advice = unit_advice(extent, *(share * reach for share in _POSSIBLE))
    advice = advice or "correct or remove the line."
    raise table.error("E-POSES-007", row, column, f"{place}, but the robot reaches {reach:.3g} m; {advice}")
