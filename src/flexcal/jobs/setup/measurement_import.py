"""Import of measurements of other programs."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.poses import (
    DISTANCE,
    PoseSet,
    check_metres,
    check_positive,
    check_same_pose,
    whole_numbers,
)
from flexcal.data.tables import JOINT_QUANTITIES, Table, check_joint_units, standard_columns, write_table
from flexcal.errors import InputError
from flexcal.importing.columns import (
    ORIENTATIONS,
    TILTS,
    TOOL,
    ColumnAssignment,
    NominalMismatch,
    RecognisedColumns,
    UnusedColumn,
    apply_map,
    check_nominal,
    guess_columns,
    reasons_unused,
    require_known_units,
)
from flexcal.importing.orientations import NominalPoses
from flexcal.importing.readers import read_foreign
from flexcal.importing.tables import ForeignTable
from flexcal.jobs.setup.motor_readings import MotorReadings
from flexcal.jobs.setup.orientation_import import (
    ImportedOrientations,
    OrientationColumns,
    import_orientations,
)
from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import rotation_wxyz, wxyz_rotation
from flexcal.model.robot import RobotModel
from flexcal.units import LARGEST, MILLIMETRE

_POSES = (
    "pose",
    "q",
    "xyz",
    "base_xyz",
    "base_quaternion",
    "length",
    *TILTS,
    "quaternion",
    *ORIENTATIONS,
    "sigma",
    "sigma_xyz",
    "tau",
    "approach",
    "payload",
    "temperature",
    "t",
)
_MEASURED = {"xyz", "length", *TILTS}
"""Quantities that poses are measured by."""
_TURNS = ("quaternion", *ORIENTATIONS)
_LOG = ("t", *JOINT_QUANTITIES, "temperature", "payload")


@dataclass(frozen=True, eq=False)
class ImportedFile:
    """Interpretation of a file's columns, and the values that were or would be written.

    kind: poses were measured, a log of joints, or joint positions only, from which poses can be chosen. columns: in flexcal's names and
    SI units. misfit: how the nominal robot goes with the points, None where there are none or too few. orientations: None where there are
    none, or points that do not fit.
    """

    file: Path
    kind: Literal["poses", "log", "joints"]
    placed: tuple[ColumnAssignment, ...]
    left_out: tuple[UnusedColumn, ...]
    columns: dict[str, np.ndarray]
    misfit: NominalMismatch | None
    orientations: ImportedOrientations | None
    remarks: tuple[str, ...]
    out: Path | None
    model: RobotModel

    @property
    def signals(self) -> dict[str, dict[str, Any]]:
        """Block `signals:` that reads the file's columns; empty if none is needed."""
        return {p.quantity: p.config() for p in self.placed if p.quantity != "pose" and not p.standard()}

    @property
    def trusted(self) -> bool:
        """Whether the points are plausible for this robot."""
        return self.misfit is None or not self.misfit.doubtful

    def mapped(self) -> list[str]:
        """The columns as --map has them, in quotes where there are spaces."""
        told = []
        for name, read in self.document()["columns"].items():
            gain, offset, unit = read["gain"], read["offset"], read["unit"]
            factor = "" if gain == 1 else "-" if gain == -1 else f"{gain:g}*"
            column = f"{name}={factor}{read['from']}" + (
                f"[{unit}]" if unit and unit not in read["from"] else ""
            )
            told.append(shlex.quote(column + (f"{offset:+g}" if offset else "")))
        return told

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "file": self.file,
            "kind": self.kind,
            "rows": len(next(iter(self.columns.values()))),
            "columns": {
                name: {"from": column, "unit": unit, "gain": gain, "offset": offset, "why": placed.why}
                for placed in self.placed
                for name, column, unit, gain, offset in zip(
                    standard_columns(placed.quantity, self.model.n),
                    placed.columns,
                    placed.units,
                    placed.gains,
                    placed.offsets,
                    strict=True,
                )
            },
            "left_out": {left.column: left.why for left in self.left_out},
            "nominal": None
            if self.misfit is None
            else {
                "rms_mm": self.misfit.rms / MILLIMETRE,
                "rms_with_point_moved_mm": self.misfit.moved_rms / MILLIMETRE,
                "point_moved_to": self.misfit.moved.tolist(),
                "doubtful": self.misfit.doubtful,
                "proposal": self.misfit.proposal,
                "map": list(self.misfit.options),
            },
            "orientation": None if self.orientations is None else self.orientations.document(),
            "signals": self.signals,
            "remarks": list(self.remarks),
            "out": self.out,
        }


def import_file(
    robot_file: Path,
    file: Path,
    *,
    mapped: Sequence[str] = (),
    out: Path | None = None,
    sigma: float | None = None,
    sheet: str | None = None,
    topic: str | None = None,
    orientation: str | None = None,
    unchecked: bool = False,
    motors: MotorReadings | None = None,
) -> ImportedFile:
    """Recognise the columns of `file`, with `mapped` overriding the guess, and write them in flexcal's format to `out`.

    `sigma` (m) is the instrument's 1σ a coordinate where the file does not say it, and `orientation` the convention of its orientations.
    `motors` says how columns of motors become joint positions; what is `mapped` comes before.
    Nothing is written without `out`, nor, unless `unchecked`, where the nominal robot cannot go with the points or the orientations. Raises
    `InputError` where the file cannot be read, joint positions are not recognised, the convention of orientations is not certain, or a
    value is missing or cannot be, and for a `sigma` that is not positive or has no place.
    """
    model = RobotModel.from_yaml(robot_file, estimates=False)
    foreign = read_foreign(file, model.motor_names, sheet=sheet, topic=topic)
    guess = recognised = guess_columns(foreign, model)
    if motors is not None:
        mapped = (*motors.mapped(file, list(foreign.numbers), model.motor_names), *mapped)
    if mapped:
        guess = apply_map(mapped, guess, foreign, model)
    require_known_units(guess, recognised, foreign)
    kind, guess = _kind(foreign, guess, model)
    columns, values = _converted(foreign, guess, model)
    remarks = list(foreign.notes)
    stated = {"sigma", "sigma_xyz"} & guess.placed.keys()
    if sigma is not None:
        _check_sigma(sigma, file, stated, guess)
        columns["sigma"] = np.full(len(foreign), sigma)
    elif {"xyz", "length"} & guess.placed.keys() and not stated:
        remarks.append(
            "the file does not state the instrument's noise: give it with --sigma MM (1σ per coordinate), or it is counted as "
            "an error of the robot"
        )
    if "xyz" in guess.placed and guess.placed["xyz"].columns == TOOL:
        remarks.append(
            "these points are computed by the controller from the joints, not measured: they cannot be used for a calibration"
        )
    if kind == "log" and "tau" not in guess.placed:
        remarks.append("there are no torques: 'identify dynamics' needs tau1 and so on")
    misfit = _misfit(guess, model, columns, values) if kind == "poses" else None
    if "xyz" in values and misfit is None:
        why = "there are too few poses" if model.points else "robot.yaml declares no point under `points:`"
        remarks.append(f"{why}, so they were not compared with the nominal robot")
    placed = tuple(guess.placed.values())
    turns = [item for item in placed if item.quantity in _TURNS]
    if orientation is not None and not turns:
        raise InputError(
            "E-IMPORT-068",
            f"--orientation is of measured orientations, but none were recognised in {file}; name their columns with --map rx=COLUMN "
            "and so on.",
        )
    imported = ImportedFile(
        file,
        kind,
        tuple(item for item in placed if item.quantity not in _TURNS),
        guess.left_out,
        columns,
        misfit,
        None,
        tuple(remarks),
        None,
        model,
    )
    if misfit is not None and misfit.proposal and not unchecked:
        return imported
    check_joint_units(model, foreign.table, guess.placed["q"].signal(), values["q"])
    if kind == "poses":
        _check_poses(foreign, guess, model, columns, values)
    elif kind == "log":
        _check_time(foreign, guess, values["t"][:, 0])
    if turns and (imported.trusted or unchecked):
        source = OrientationColumns(foreign, turns[0], values[turns[0].quantity])
        # the convention of orientations is told by a base that stands still
        still = imported.trusted and "base_quaternion" not in values
        groups = _nominal_poses(model, columns, values, misfit) if still else []
        turned = import_orientations(source, groups, orientation, unchecked=unchecked)
        imported = _with_orientations(imported, turned)
    if out is None or not (imported.trusted or unchecked):
        return imported
    write_table(out, imported.columns)
    return replace(imported, out=out)


def _kind(
    foreign: ForeignTable, guess: RecognisedColumns, model: RobotModel
) -> tuple[Literal["poses", "log", "joints"], RecognisedColumns]:
    """Kind of the file, and the guess restricted to its quantities, in the order of the columns to write."""
    unsure = [left for left in guess.left_out if "could both be" in left.why]
    if "q" not in guess.placed or (unsure and not {*_MEASURED, "t"} & guess.placed.keys()):
        left = "; ".join(reasons_unused(guess.left_out)) or "every column is something else"
        what = (
            f"the joint positions q1 … q{model.n}"
            if "q" not in guess.placed
            else "the measured points x, y, z"
        )
        example = "q1=COLUMN[deg]" if "q" not in guess.placed else "x=COLUMN[mm]"
        raise InputError(
            "E-RUN-084",
            f"{foreign.table.file.path}: {what} were not recognised ({left}); say which they are: --map {example} and so on.",
        )
    kind = "poses" if _MEASURED & guess.placed.keys() else "log" if "t" in guess.placed else "joints"
    wanted = {"poses": _POSES, "log": _LOG, "joints": ("pose", "q", "payload")}[kind]
    placed = {quantity: guess.placed[quantity] for quantity in wanted if quantity in guess.placed}
    reasons = {"payload": "robot.yaml declares no payload"}
    if model.payload is None:
        placed.pop("payload", None)
    if "xyz" not in placed:
        for quantity in _TURNS:
            placed.pop(quantity, None)
            reasons[quantity] = "there are no points x, y, z with these orientations"
    what = {"poses": "measured poses", "log": "a log of joints", "joints": "joint positions only"}[kind]
    left = [
        UnusedColumn(column, reasons.get(quantity, f"it looks like {quantity}, which is no part of {what}"))
        for quantity, item in guess.placed.items()
        if quantity not in placed
        for column in item.columns
    ]
    texts = guess.texts if kind == "poses" else {}
    left += [
        UnusedColumn(column, f"no part of {what}")
        for name, column in guess.texts.items()
        if name not in texts
    ]
    return kind, RecognisedColumns(placed, texts, (*guess.left_out, *left))


def _converted(
    foreign: ForeignTable, guess: RecognisedColumns, model: RobotModel
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Columns (N,) by flexcal's names, and quantities (N, m); raises `InputError` at the first missing value."""
    columns: dict[str, np.ndarray] = {}
    values: dict[str, np.ndarray] = {}
    if "pose" not in guess.placed and (_MEASURED & guess.placed.keys() or "t" not in guess.placed):
        columns["pose"] = np.arange(1, len(foreign) + 1)
    for quantity, placed in guess.placed.items():
        for column in placed.columns:
            numbers = foreign.numbers[column]
            bad = ~(np.abs(numbers) <= LARGEST)
            if bad.any():
                row = int(np.argmax(bad))
                what = "there is no time" if column in foreign.times else "there is no number"
                if not np.isnan(numbers[row]):
                    what = f"the value is {numbers[row]:g}, which is no measurement"
                raise foreign.table.error(
                    "E-RUN-085",
                    row,
                    column,
                    f"{what}; complete or remove the line, or discard the column with --map {quantity}=none.",
                )
        values[quantity] = placed.values(foreign.table)
        if quantity not in _TURNS:
            names = standard_columns(quantity, model.n)
            columns |= {name: values[quantity][:, i] for i, name in enumerate(names)}
    if "pose" in columns:
        if "pose" in guess.placed:
            columns["pose"] = whole_numbers(foreign.table, guess.placed["pose"].columns[0], columns["pose"])
        values["pose"] = columns["pose"]
    columns |= {name: foreign.table.columns[column] for name, column in guess.texts.items()}
    return columns, values


def _check_poses(
    foreign: ForeignTable,
    guess: RecognisedColumns,
    model: RobotModel,
    columns: dict[str, np.ndarray],
    values: dict[str, np.ndarray],
) -> None:
    n = len(foreign)
    table: Table = foreign.table
    check_same_pose(values["pose"], values["q"], table)
    for quantity in ("sigma", "sigma_xyz", "length"):
        if quantity in values:
            check_positive(table, guess.placed[quantity].signal(), values[quantity], zero=False)
    if not {"xyz", "length"} & values.keys():
        return
    place = "xyz" if "xyz" in values else "length"
    poses = PoseSet(
        q=values["q"],
        position=values["xyz"] if place == "xyz" else values["length"] * [1.0, 0.0, 0.0],
        sigma=np.ones((n, 3)),
        torque=None,
        payload=None,
        target=columns.get("target", np.full(n, "")),
        station=columns.get("station", np.full(n, "")),
        temperature=None,
        pose=values["pose"],
        kind=None if place == "xyz" else np.full(n, DISTANCE),
    )
    check_metres(poses, model, table, guess.placed[place].signal())


def _check_sigma(sigma: float, file: Path, stated: set[str], guess: RecognisedColumns) -> None:
    if not 0 < sigma < np.inf:
        raise InputError("E-RUN-086", f"--sigma is {sigma / MILLIMETRE:g}; it must be positive, in mm.")
    if not {"xyz", "length"} & guess.placed.keys():
        left = "; ".join(reasons_unused(guess.left_out))
        unused = f" ({left}); say which they are with --map x=COLUMN[mm] and so on, or" if left else ";"
        raise InputError(
            "E-RUN-087",
            f"--sigma is of measured points, but none were recognised in {file}{unused} leave --sigma out.",
        )
    if stated:
        raise InputError(
            "E-RUN-088",
            f"{file} contains sigma; leave --sigma out, or discard its own with --map {min(stated)}=none.",
        )


def _check_time(foreign: ForeignTable, guess: RecognisedColumns, t: np.ndarray) -> None:
    if (np.diff(t) <= 0).any():
        row = int(np.argmax(np.diff(t) <= 0)) + 1
        raise foreign.table.error(
            "E-RUN-089",
            row,
            guess.placed["t"].columns[0],
            "the time does not increase; sort or repair the log.",
        )


def _with_orientations(imported: ImportedFile, turned: ImportedOrientations) -> ImportedFile:
    """The file with the columns qw, qx, qy and qz behind those of the points."""
    quaternion = dict(zip(standard_columns("quaternion", 0), rotation_wxyz(turned.rotations).T, strict=True))
    columns: dict[str, np.ndarray] = {}
    for name, values in imported.columns.items():
        columns[name] = values
        if name == "z":
            columns |= quaternion
    linear = turned.assignment()
    return replace(
        imported,
        placed=imported.placed if linear is None else (*imported.placed, linear),
        columns=columns,
        orientations=turned,
        remarks=(*imported.remarks, *turned.remarks),
    )


def _groups(columns: dict[str, np.ndarray], n: int) -> list[tuple[np.ndarray, str | None]]:
    """Rows (M,) of every station and target, and the target's name where there is one, the largest first."""
    places = np.stack([columns.get(name, np.full(n, "")) for name in ("station", "target")], axis=1)
    groups, inverse, counts = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    return [
        (np.flatnonzero(inverse.ravel() == group), str(groups[group, 1]) or None)
        for group in np.argsort(-counts, kind="stable")
    ]


def _nominal_poses(
    model: RobotModel,
    columns: dict[str, np.ndarray],
    values: dict[str, np.ndarray],
    misfit: NominalMismatch | None,
) -> list[tuple[np.ndarray, NominalPoses]]:
    """Rows (M,) of every station and target with the nominal robot's poses; none where these were not compared with the points."""
    if misfit is None:
        return []
    nominal = []
    for rows, target in _groups(columns, len(values["q"])):
        at = point_kinematics(model, values["q"][rows], point=target, jacobians=False)
        shift = misfit.moved - misfit.declared if model.point(target).name == misfit.point else np.zeros(3)
        poses = NominalPoses(at.position, at.orientation, values["xyz"][rows], model.reach, shift)
        nominal.append((rows, poses))
    return nominal


def _misfit(
    guess: RecognisedColumns, model: RobotModel, columns: dict[str, np.ndarray], values: dict[str, np.ndarray]
) -> NominalMismatch | None:
    """Misfit of the largest group of rows with one station and target."""
    if "xyz" not in values or not model.points:
        return None
    rows, target = _groups(columns, len(values["q"]))[0]
    return check_nominal(
        model,
        values["q"][rows],
        _from_base(values)[rows],
        guess.placed["q"],
        point=target,
        points=guess.placed["xyz"],
    )


def _from_base(values: dict[str, np.ndarray]) -> np.ndarray:
    """Points (N, 3), m, as seen from a base that moves and was measured too; as measured without."""
    if not {"base_xyz", "base_quaternion"} <= values.keys():
        return values["xyz"]
    turns = wxyz_rotation(values["base_quaternion"])
    return np.einsum("nji,nj->ni", turns, values["xyz"] - values["base_xyz"])
