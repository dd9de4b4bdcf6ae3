"""Files of joint positions with lengths of a draw-wire, or at contact with a plane, a line or a sphere: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from flexcal.data.poses.checks import check_metres, check_same_pose
from flexcal.data.poses.columns import (
    approach_columns,
    check_noise,
    check_positive,
    first_point,
    payload_column,
    target_column,
    whole_numbers,
)
from flexcal.data.poses.pose_set import DEFAULT_SIGMA, DISTANCE, PLANE, PoseSet, kind_of_face
from flexcal.data.tables import (
    Table,
    TableFile,
    assign,
    check_joint_units,
    timestamp_columns,
    with_seconds,
)
from flexcal.files.structuring import suggestion
from flexcal.model.robot import FACES

if TYPE_CHECKING:
    from flexcal.model.robot import FaceConfig, RobotModel, WireConfig

WIRE, TOUCHED, READING, LENGTH = "wire", "touched", "reading", "length"
_COORDINATE = {DISTANCE: 0, PLANE: 2}


def measures_distances(file: TableFile, model: RobotModel) -> bool:
    """Whether a file has a column `length`, by its own name or as `signals:` maps it, or `touched`."""
    mapped = model.config.signals
    named = set(mapped[LENGTH].columns) if LENGTH in mapped else set[str]()
    return TOUCHED in file.columns or LENGTH in file.columns or (bool(named) and named <= set(file.columns))


def read_distances(file: TableFile, model: RobotModel, further: Sequence[str] = ()) -> PoseSet:
    """Read rows of q1…qn with `length` (m) of a draw-wire, or `touched`, the name of a face, with the `reading` (m) of a dial gauge.

    Names are those under `measurements:` of robot.yaml; with several wires a column `wire` names them. Optional are `pose`, `target`,
    `sigma`, `payload`, `temperature`, `t`, `tau1`… and `approach1`…, and the `further` columns, which are not used. Raises `InputError`
    where robot.yaml declares no such instrument, for an unknown name, and for columns of both.
    """
    touched = TOUCHED in file.columns
    if touched and (measured := {LENGTH, "x", "y", "z"} & set(file.columns)):
        raise file.error(
            "E-POSES-018",
            f"there are both '{TOUCHED}' and {', '.join(sorted(measured))}; give every instrument a file of its own.",
        )
    if not touched and {"x", "y", "z"} & set(file.columns):
        raise file.error(
            "E-POSES-057", "there are both 'length' and x, y, z; keep the columns of one instrument."
        )
    name_column = TOUCHED if touched else WIRE
    texts = tuple(name for name in (name_column, "target", *further) if name in file.columns)
    texts = tuple(dict.fromkeys(texts))
    value = READING if touched else LENGTH
    optional = ("pose", "tau", "payload", "approach", "sigma", "temperature", "t")
    optional = (*optional, READING) if touched else optional
    signals = assign(file, model, ("q", *(() if touched else (LENGTH,))), optional, texts)
    stamps = timestamp_columns(signals)
    (table,) = with_seconds([file.read((*texts, *stamps))], stamps)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    rows = len(table)
    if LENGTH in values:
        check_positive(table, signals[LENGTH], values[LENGTH], zero=False)
    if "sigma" in values:
        check_noise(table, signals["sigma"], values["sigma"], values.get(value, values["q"]))
    declared = _declared(file, model, touched=touched)
    names = _names(table, declared, name_column, rows)
    kind = np.array([kind_of_face(declared[name].kind) for name in names.tolist()])
    position = np.zeros((rows, 3))
    read = values[value][:, 0] if value in values else np.zeros(rows)
    for own, coordinate in _COORDINATE.items():
        position[kind == own, coordinate] = read[kind == own]
    sigma = values["sigma"][:, 0] if "sigma" in values else _declared_sigma(declared, names)
    pose = (
        whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0]) if "pose" in values else None
    )
    poses = PoseSet(
        q=values["q"],
        position=position,
        sigma=np.repeat((np.full(rows, DEFAULT_SIGMA) if sigma is None else sigma)[:, None], 3, axis=1),
        torque=values.get("tau"),
        payload=payload_column(table, signals, model),
        target=target_column(table, model) if "target" in texts else np.full(rows, first_point(file, model)),
        station=names,
        temperature=values["temperature"][:, 0] if "temperature" in values else None,
        time=values["t"][:, 0] if "t" in values else None,
        pose=np.arange(1, rows + 1) if pose is None else pose,
        kind=kind,
        approach=approach_columns(table, signals),
        sigma_given=sigma is not None,
    )
    check_same_pose(poses.pose, poses.q, table)
    if not touched:
        check_metres(poses, model, table, signals[LENGTH])
    return poses


def _declared(file: TableFile, model: RobotModel, *, touched: bool) -> Mapping[str, WireConfig | FaceConfig]:
    """Instruments under `measurements:` of robot.yaml that such a file may name."""
    measurements = cast("Mapping[str, Any]", model.config.measurements)
    if touched:
        faces = {k: item for k, item in measurements.items() if item.kind in FACES}
        if not faces:
            raise file.error(
                "E-POSES-058",
                f"there is a column '{TOUCHED}', but robot.yaml declares nothing to touch; add `measurements: {{table: {{kind: plane}}}}` "
                f"(or {', or '.join(list(FACES)[1:])}) with the names in that column.",
            )
        return faces
    wires = {k: item for k, item in measurements.items() if item.kind == "wire"}
    if not wires:
        raise file.error(
            "E-POSES-059",
            "there is a column of lengths, but robot.yaml declares no draw-wire; add `measurements: {wire: {kind: wire}}`.",
        )
    if len(wires) > 1 and WIRE not in file.columns:
        raise file.error(
            "E-POSES-060",
            f"robot.yaml declares the wires {', '.join(wires)}; add a column '{WIRE}' with the name of that which was read.",
        )
    return wires


def _names(
    table: Table, declared: Mapping[str, WireConfig | FaceConfig], column: str, rows: int
) -> np.ndarray:
    """Names (N,) of the instruments of every row."""
    if column not in table.columns:
        return np.full(rows, next(iter(declared)))
    names = table.columns[column]
    for row, name in enumerate(names.tolist()):
        if name not in declared:
            known = list(declared)
            hint = suggestion(name, known) or f"; known are {', '.join(known)}."
            raise table.error(
                "E-POSES-061", row, column, f"there is no '{name}' under `measurements:` of robot.yaml{hint}"
            )
    return names


def _declared_sigma(declared: Mapping[str, WireConfig | FaceConfig], names: np.ndarray) -> np.ndarray | None:
    """Standard deviations (N,), m, as declared; None where one is not."""
    known = {name: declared[name].std for name in dict.fromkeys(names.tolist())}
    if any(std is None for std in known.values()):
        return None
    return np.array([known[name] for name in names.tolist()], dtype=float)
