"""Import of measured orientations: the nominal robot tells the convention of their columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.importing.columns import ColumnAssignment
from flexcal.importing.orientations import (
    Convention,
    ConventionChoice,
    EulerAngles,
    NominalPoses,
    OrientationFit,
    Quaternion,
    RotationVector,
    angle_units,
    candidates,
    choose_convention,
    fit_orientations,
    odd_angle,
    parse_convention,
    reordered_candidates,
)
from flexcal.importing.tables import ForeignTable
from flexcal.units import DEGREE

_FEWEST = 6
"""Least number of rows with one station and target whose orientations are compared."""
_NORM = 1e-3
"""Largest relative deviation of the norm of a quaternion from that of the others, and of that from 1."""
_NAMED = 3
"""Largest number of conventions that a message lists."""


@dataclass(frozen=True, eq=False)
class OrientationColumns:
    """Columns of a foreign file that hold orientations, and their numbers `values` (N, 3) or (N, 4)."""

    foreign: ForeignTable
    placed: ColumnAssignment
    values: np.ndarray

    @property
    def listed(self) -> str:
        """Names of the columns."""
        return ", ".join(self.placed.columns)

    @property
    def left_out(self) -> str:
        """What leaves the columns out."""
        return f"--map {self.placed.quantity}=none"

    def candidates(self, values: np.ndarray, *, any_unit: bool = False) -> list[Convention]:
        """Conventions of `values` that the names and units of the columns allow."""
        quantity, unit = self.placed.quantity, self.placed.unit
        said = None if any_unit else "deg" if unit == "deg" else "rad" if unit == "rad" else None
        first = True if quantity == "quaternion" else None
        return candidates(values, said, by_axis=quantity == "rxyz", scalar_first=first)

    def named(self, option: str) -> list[Convention]:
        """The convention of --orientation, in every unit that the columns can have."""
        units = angle_units(self.values) if self.placed.unit is None else (self.placed.unit,)
        listed = [
            parse_convention(
                option,
                self.values.shape[1],
                "rad" if unit == "rad" else "deg",
                by_axis=self.placed.quantity == "rxyz",
            )
            for unit in units
        ]
        return list(dict.fromkeys(listed))

    def error(self, code: str, sentence: str) -> InputError:
        """An error of the columns as a whole."""
        return InputError(code, f"{self.foreign.table.file.path}: {sentence}")


@dataclass(frozen=True, eq=False)
class ImportedOrientations:
    """Measured orientations and how they were read.

    rotations: (N, 3, 3), from the target's to the instrument's frame. norm: of the quaternions in the file. compared: the fit to the
    nominal robot, None where there was none. remarks: a sentence each.
    """

    source: OrientationColumns
    convention: Convention
    rotations: np.ndarray
    norm: float
    compared: ConventionChoice | None
    remarks: tuple[str, ...]

    def assignment(self) -> ColumnAssignment | None:
        """The columns as qw, qx, qy and qz, for quaternions; None for angles, which are not linear."""
        if not isinstance(self.convention, Quaternion):
            return None
        placed = self.source.placed
        order = (0, 1, 2, 3) if self.convention.scalar_first else (3, 0, 1, 2)
        signs = (1.0, *(-1.0 if self.convention.transposed else 1.0,) * 3)
        gains = tuple(sign * placed.gains[i] / self.norm for sign, i in zip(signs, order, strict=True))
        columns = tuple(placed.columns[i] for i in order)
        return ColumnAssignment("quaternion", columns, (None,) * 4, placed.why, gains, (0.0,) * 4)

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        choice = self.compared
        following = None if choice is None else choice.following
        return {
            "from": list(self.source.placed.columns),
            "convention": self.convention.option,
            "meaning": self.convention.words,
            "rms_deg": None if choice is None else choice.best.rms / DEGREE,
            "next": None
            if following is None
            else {"convention": following.convention.option, "rms_deg": following.rms / DEGREE},
        }


def import_orientations(
    columns: OrientationColumns,
    groups: Sequence[tuple[np.ndarray, NominalPoses]],
    option: str | None,
    *,
    unchecked: bool,
) -> ImportedOrientations:
    """Read orientations in the convention that `option` names, else in the one in which they are those of the nominal robot.

    `groups` are rows (M,) with one station and target, and the nominal robot's poses there, the largest group first; none where these could
    not be compared with the points. Raises `InputError` where no convention is certain, for quaternions of different norms, and,
    unless `unchecked`, for orientations or rows of them that do not fit.
    """
    norm = _checked_norm(columns) if columns.values.shape[1] == 4 else 1.0
    allowed = columns.candidates(columns.values) if option is None else columns.named(option)
    groups = [group for group in groups if len(group[0]) >= _FEWEST]
    if not groups:
        return _not_compared(columns, allowed, norm)
    rows, nominal = groups[0]
    values = columns.values[rows]
    choice = choose_convention(nominal, allowed, values)
    if option is None and not choice.certain:
        raise _uncertain(columns, nominal, values, choice)
    if option is not None and not choice.fits and not unchecked:
        raise _contradicted(columns, nominal, values, choice, option)
    convention = choice.best.convention
    for rows, nominal in groups:
        fit = fit_orientations(nominal, convention, columns.values[rows])
        if not unchecked:
            _check_rows(columns, rows, fit)
    remarks = [_fit_in_words(columns, choice)]
    if abs(norm - 1) > _NORM:
        remarks.append(f"the quaternions {columns.listed} have the norm {norm:.4g}, and were divided by it")
    return ImportedOrientations(
        columns, convention, convention.rotations(columns.values), norm, choice, tuple(remarks)
    )


def _checked_norm(columns: OrientationColumns) -> float:
    """Norm that the quaternions share; raises `InputError` at the first of another."""
    norms = np.linalg.norm(columns.values, axis=1)
    usual = float(np.median(norms))
    odd = np.abs(norms - usual) > _NORM * usual
    if usual == 0 or odd.any():
        row = int(np.argmax(odd))
        raise columns.foreign.table.error(
            "E-IMPORT-059",
            row,
            columns.placed.columns[0],
            f"the quaternion {columns.listed} has the norm {norms[row]:.4g}, others {usual:.4g}; correct it, or leave "
            f"orientations out with {columns.left_out}.",
        )
    return usual


def _not_compared(
    columns: OrientationColumns, allowed: Sequence[Convention], norm: float
) -> ImportedOrientations:
    """Orientations whose convention was said, by --orientation or as qw, qx, qy and qz."""
    if columns.placed.quantity == "quaternion":
        allowed = [convention for convention in allowed if not convention.transposed] or allowed
    if len(allowed) > 1 or abs(norm - 1) > _NORM:
        raise columns.error(
            "E-IMPORT-060",
            f"the convention of the orientations {columns.listed} cannot be told, because they cannot be compared with the nominal robot; "
            f"say it, as in --orientation {_examples(columns)}, or leave them out with {columns.left_out}.",
        )
    convention = allowed[0]
    remark = f"{columns.listed} are taken as {convention.words}, and were not compared with the nominal robot"
    return ImportedOrientations(
        columns, convention, convention.rotations(columns.values), norm, None, (remark,)
    )


def _uncertain(
    columns: OrientationColumns, nominal: NominalPoses, values: np.ndarray, choice: ConventionChoice
) -> InputError:
    """What is to be said where no convention fits, or several do."""
    either = f"say the convention, as in --orientation {_examples(columns)}, or leave them out with {columns.left_out}"
    if choice.fits:
        others = choice.rivals[: _NAMED - 1]
        named = ", or as ".join(_named(fit) for fit in (choice.best, *others))
        more = len(choice.rivals) - len(others)
        further = f", and {more} more conventions" if more else ""
        return columns.error(
            "E-IMPORT-061",
            f"the orientations {columns.listed} fit the robot about as well as {named}{further}; say which it is with --orientation, "
            f"or leave them out with {columns.left_out}.",
        )
    if choice.steady:
        return columns.error(
            "E-IMPORT-062",
            f"the orientations {columns.listed} vary by {choice.spread / DEGREE:.2g} deg only, so that their "
            f"convention cannot be told; {either}.",
        )
    explained = _explained(columns, nominal, values)
    if explained:
        return columns.error("E-IMPORT-063", f"the orientations {columns.listed} {explained}.")
    return columns.error(
        "E-IMPORT-064",
        f"the orientations {columns.listed} fit the robot in no known convention: the best, {_named(choice.best)}; {either}.",
    )


def _explained(columns: OrientationColumns, nominal: NominalPoses, values: np.ndarray) -> str:
    """A convention that the names or units of the columns exclude, but which fits, with the options that say it."""
    if columns.values.shape[1] == 4:
        listed: list[Convention] = [Quaternion(turned, False) for turned in (False, True)]
    else:
        listed = reordered_candidates(values)
    choice = choose_convention(nominal, listed, values)
    if not choice.certain:
        return ""
    convention, names = choice.best.convention, columns.placed.columns
    told = f"fit as {convention.words} only ({choice.best.rms / DEGREE:.2g} deg rms)"
    if isinstance(convention, Quaternion):
        return f"{told}, against their names: --orientation {convention.option}"
    order = convention.columns if isinstance(convention, EulerAngles) else (0, 1, 2)
    unit = f"[{convention.unit}]" if isinstance(convention, EulerAngles | RotationVector) else ""
    sources = " ".join(f"'angle{k + 1}={names[i]}{unit}'" for k, i in enumerate(order))
    return f"{told}, in the order {', '.join(names[i] for i in order)}: --map {sources} --orientation {convention.option}"


def _contradicted(
    columns: OrientationColumns,
    nominal: NominalPoses,
    values: np.ndarray,
    choice: ConventionChoice,
    option: str,
) -> InputError:
    """What is to be said where the named convention does not fit."""
    other = choose_convention(nominal, columns.candidates(values), values)
    advice = f"; as {_named(other.best)} they fit" if other.certain else ""
    return columns.error(
        "E-IMPORT-065",
        f"the orientations {columns.listed}, read as --orientation {option}, are {choice.best.rms / DEGREE:.2g} deg (rms) off the nominal "
        f"robot{advice}; correct the option, or write them with --unchecked.",
    )


def _check_rows(columns: OrientationColumns, rows: np.ndarray, fit: OrientationFit) -> None:
    """Raise `InputError` at the first row whose orientation is not like the others; says in which convention it would be."""
    if not fit.odd.any():
        return
    values = columns.values[rows][fit.odd]
    predicted = np.swapaxes(fit.predicted[fit.odd], 1, 2)
    limit = odd_angle(fit.angles)
    table, row = columns.foreign.table, int(rows[np.argmax(fit.odd)])
    count = int(fit.odd.sum())
    many = f"{count} rows from here on are" if count > 1 else "this row is"
    for convention in columns.candidates(values, any_unit=True):
        apart = _angles(predicted @ convention.rotations(values))
        if (apart < limit).mean() > 0.5:
            raise table.error(
                "E-IMPORT-066",
                row,
                columns.placed.columns[0],
                f"{many} {convention.words}, but the others {fit.convention.words}; import the rows of each "
                "convention as a file of their own.",
            )
    worst = float(fit.angles[fit.odd][0]) / DEGREE
    raise table.error(
        "E-IMPORT-067",
        row,
        columns.placed.columns[0],
        f"the orientation is {worst:.3g} deg off the nominal robot, but most are {fit.rms / DEGREE:.2g} deg off it"
        + (f" (so are {count - 1} more rows)" if count > 1 else "")
        + "; correct or remove the line, or write it with --unchecked.",
    )


def _angles(rotations: np.ndarray) -> np.ndarray:
    """Angles (N,), rad, of rotations (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(rotations).magnitude()


def _fit_in_words(columns: OrientationColumns, choice: ConventionChoice) -> str:
    """How well the convention fits, and the next."""
    told = f"{columns.listed} are {choice.best.convention.words}: {choice.best.rms / DEGREE:.2g} deg rms beside the nominal robot"
    if choice.following is None:
        return told
    following = choice.following
    return f"{told}; the next best, {following.convention.words}: {following.rms / DEGREE:.2g} deg"


def _named(fit: OrientationFit) -> str:
    convention = fit.convention
    return f"{convention.words} ({fit.rms / DEGREE:.2g} deg rms, --orientation {convention.option})"


def _examples(columns: OrientationColumns) -> str:
    if columns.values.shape[1] == 4:
        return "wxyz or xyzw"
    return "xyz-extrinsic, zyx-intrinsic or rotation-vector"
