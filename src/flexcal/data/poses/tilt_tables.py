"""Files of joint positions with the readings of an inclinometer, or of an accelerometer at rest: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.checks import check_same_pose
from flexcal.data.poses.columns import approach_columns, check_noise, payload_column, whole_numbers
from flexcal.data.poses.pose_set import DIRECTION, PoseSet
from flexcal.data.tables import Table, TableFile, assign, check_joint_units, timestamp_columns, with_seconds
from flexcal.files.structuring import suggestion
from flexcal.model.robot import VERTICAL

if TYPE_CHECKING:
    from flexcal.data.tables import Signal
    from flexcal.model.robot import InclinometerConfig, RobotModel

INCLINOMETER = "inclinometer"
TILTS = ("tilt_x", "tilt_y", "tilt_z")
_LARGEST = {"elevation": np.pi / 2, "projection": np.pi, "component": 1.0}
"""Largest reading of an axis, rad or 1, by what it reads."""
_SLACK = 0.05
"""Share by which noise, zero and scale of a sensor may take it beyond."""


def measures_tilts(file: TableFile, model: RobotModel) -> bool:
    """Whether a file has a column of an inclinometer, by its own name or as `signals:` maps it."""
    mapped = model.config.signals
    named = {column for name in TILTS if name in mapped for column in mapped[name].columns}
    return not {*TILTS, *named}.isdisjoint(file.columns)


def read_tilts(file: TableFile, model: RobotModel, further: Sequence[str] = ()) -> PoseSet:
    """Read rows of q1…qn with one or more of `tilt_x`, `tilt_y`, `tilt_z` (rad, or 1 where robot.yaml says `reads: component`).

    With several inclinometers under `measurements:` of robot.yaml a column `inclinometer` names them. Optional are `pose`, `payload`,
    `sigma_angle`, `temperature`, `t`, `tau1`… and `approach1`…, and the `further` columns, which are not used. Raises `InputError` where
    robot.yaml declares no inclinometer, for an unknown name, for columns of another instrument, and for readings that its axes cannot have.
    """
    if measured := {"x", "y", "z", "length", "touched", "fixture", "image"} & set(file.columns):
        raise file.error(
            "E-POSES-069",
            f"there are both tilts and {', '.join(sorted(measured))}; give every instrument a file of its own.",
        )
    texts = tuple(dict.fromkeys(n for n in (INCLINOMETER, *further) if n in file.columns))
    optional = (*TILTS, "pose", "tau", "payload", "approach", "sigma_angle", "temperature", "t")
    signals = assign(file, model, ("q",), optional, texts)
    stamps = timestamp_columns(signals)
    (table,) = with_seconds([file.read((*texts, *stamps))], stamps)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    rows = len(table)
    declared = _declared(file, model)
    names = _names(table, declared, rows)
    tilt = np.full((rows, 3), np.nan)
    for k, name in enumerate(TILTS):
        if name in values:
            tilt[:, k] = values[name][:, 0]
            _check_range(table, declared, names, signals[name], tilt[:, k])
    if "sigma_angle" in values:
        check_noise(
            table, signals["sigma_angle"], values["sigma_angle"], tilt[:, ~np.isnan(tilt).all(axis=0)]
        )
    stds = {name: declared[name].std for name in dict.fromkeys(names.tolist())}
    given = "sigma_angle" in values or None not in stds.values()
    sigma = (
        values["sigma_angle"][:, 0]
        if "sigma_angle" in values
        else np.array([stds[name] or np.nan for name in names.tolist()], dtype=float)
    )
    pose = (
        whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0])
        if "pose" in values
        else np.arange(1, rows + 1)
    )
    check_same_pose(pose, values["q"], table)
    return replace(
        PoseSet.unmeasured(values["q"], names, VERTICAL),
        torque=values.get("tau"),
        payload=payload_column(table, signals, model),
        temperature=values["temperature"][:, 0] if "temperature" in values else None,
        time=values["t"][:, 0] if "t" in values else None,
        pose=pose,
        orientation_sigma=sigma if given else None,
        kind=np.full(rows, DIRECTION),
        tilt=tilt,
        approach=approach_columns(table, signals),
        sigma_given=given,
    )


def _declared(file: TableFile, model: RobotModel) -> Mapping[str, InclinometerConfig]:
    declared = {k: item for k, item in model.config.measurements.items() if item.kind == INCLINOMETER}
    if not declared:
        raise file.error(
            "E-POSES-070",
            "there are readings of an inclinometer, but robot.yaml declares none; add `measurements: {level: {kind: inclinometer, frame: "
            "FRAME, std: 5e-5}}` with the frame of the URDF that carries it, and its standard deviation in rad.",
        )
    if len(declared) > 1 and INCLINOMETER not in file.columns:
        raise file.error(
            "E-POSES-071",
            f"robot.yaml declares the inclinometers {', '.join(declared)}; add a column '{INCLINOMETER}' with the name of that which was "
            "read.",
        )
    return declared


def _names(table: Table, declared: Mapping[str, InclinometerConfig], rows: int) -> np.ndarray:
    """Names (N,) of the inclinometers of every row."""
    if INCLINOMETER not in table.columns:
        return np.full(rows, next(iter(declared)))
    names = table.columns[INCLINOMETER]
    for row, name in enumerate(names.tolist()):
        if name not in declared:
            known = list(declared)
            hint = suggestion(name, known) or f"; known are {', '.join(known)}."
            raise table.error(
                "E-POSES-072",
                row,
                INCLINOMETER,
                f"there is no inclinometer '{name}' under `measurements:` of robot.yaml{hint}",
            )
    return names


def _check_range(
    table: Table,
    declared: Mapping[str, InclinometerConfig],
    names: np.ndarray,
    signal: Signal,
    values: np.ndarray,
) -> None:
    """Raise `InputError` at the first reading (N,) that is larger than an axis can read."""
    limits = {name: item.range or _LARGEST[item.reads] for name, item in declared.items()}
    largest = np.array([limits[name] for name in names.tolist()])
    wrong = np.abs(values) > largest * (1 + _SLACK)
    if not wrong.any():
        return
    row = int(np.argmax(wrong))
    item = declared[str(names[row])]
    unit, most, reads = "" if item.reads == "component" else " rad", largest[row], item.reads
    advice = (
        "leave the row out where the sensor was at its end, or correct its `range:`."
        if item.range is not None
        else "components are in units of gravity, as m/s² divided by 9.81."
        if reads == "component"
        else "these look like degrees: convert them to rad, or declare 'unit: deg' under `signals:`; or say `reads:` as the sensor does."
    )
    raise table.error(
        "E-POSES-073",
        row,
        signal.columns[0],
        f"the inclinometer reads {values[row]:.4g}{unit}, but {reads} is at most {most:.4g}{unit}; {advice}",
    )
