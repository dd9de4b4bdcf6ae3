"""Denavit-Hartenberg tables, standard and modified, nominal beside calibrated, and their reader."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from io import StringIO
from typing import Literal

import numpy as np

from flexcal.export.chain import chain_to
from flexcal.export.dh_parameters import (
    NEARLY_PARALLEL,
    DhChain,
    chain_axes,
    dh_chain,
    nominal_angle,
    slides_moved,
)
from flexcal.export.representation_error import AT_REST, ToolMap
from flexcal.export.transforms import X, Y, Z, from_xyz_rpy, shifted, turned, xyz_rpy
from flexcal.export.written_file import RenderedModel, rows_of
from flexcal.model.robot import RobotModel, propagated_covariance_root

Convention = Literal["standard", "modified"]
Row = tuple[str, str, dict[str, float]]
"""Joint (or base, tool), type, and its parameters by name."""

UNITS = {
    "theta": "rad", "d": "m", "a": "m", "alpha": "rad", "beta": "rad",
    "x": "m", "y": "m", "z": "m", "roll": "rad", "pitch": "rad", "yaw": "rad",
}  # fmt: skip
COLUMNS = ("joint", "type", "parameter", "unit", "nominal", "calibrated", "difference", "std", "determined")
_MOSTLY = 0.7
"""Share of a standard deviation that corresponds to half of the variance."""
_LARGE = {"rad": math.radians(5.0), "m": 0.05}
"""Change from which URDF and controller probably have different tables."""
_ORDER = {
    "standard": ("theta", "d", "a", "alpha", "beta"),
    "modified": ("alpha", "a", "beta", "theta", "d"),
}
_SAYS = {
    "standard": (
        "Standard Denavit-Hartenberg (Denavit and Hartenberg 1955; Spong): a row is Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta).",
        "Frame k lies on the axis of joint k + 1.",
    ),
    "modified": (
        "Modified Denavit-Hartenberg (Craig; Khalil and Kleinfinger): a row is Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d).",
        "Frame k lies on the axis of joint k; alpha, a and beta of a row lead to it from the axis before.",
    ),
}


def render_dh(
    model: RobotModel,
    nominal: RobotModel,
    convention: Convention,
    *,
    point: str | None = None,
    four_parameters: bool = False,
    unseen: RobotModel | None = None,
) -> RenderedModel:
    """The chain that moves a target as a CSV table in a convention: joint, parameter, nominal, calibrated, difference; base and tool too.

    beta stands for d between axes that are nominally within 1° of parallel (Hayati, Mirmirani 1985); with `four_parameters` it is never
    used. `unseen` is the robot with only that in its posterior which the measured points leave open: parameters of which that is the
    larger part are marked as not determined. Raises `FlexcalError` for a robot without points, or an unknown point.
    """
    target, chain = chain_to(model, point, "Denavit-Hartenberg parameters")
    straight = chain_axes(nominal, target, chain)
    before = dh_chain(straight, hayati=not four_parameters)
    kinds = [model.joints[i].kind for i in chain]
    names = [(model.joints[i].name, model.joints[i].kind) for i in chain]

    def calibrated(changed: RobotModel) -> DhChain:
        axes = slides_moved(chain_axes(changed, target, chain), straight, kinds)
        return dh_chain(axes, hayati=not four_parameters, like=before)

    after = calibrated(model)
    old, new = (_rows(dh, names, convention) for dh in (before, after))

    def parameter_rows(changed: RobotModel) -> list[Row]:
        return _rows(calibrated(changed), names, convention)

    std = _std(model, new, parameter_rows)
    open_ = [{}] * len(new) if unseen is None else _undetermined(std, _std(unseen, new, parameter_rows))
    text = _csv(old, new, std, open_)
    left = [name for i, name in enumerate(model.joint_names) if i not in chain]
    remarks = _remarks(before, after, [name for name, _ in names], four_parameters)
    left_open = [
        f"{key} of {name}" for (name, _, _), keys in zip(new, open_, strict=True) for key in keys if keys[key]
    ]
    if left_open:
        remarks += (f"Not determined by what was measured, and about nominal: {', '.join(left_open)}.",)
    large = _large(old, new)
    if large:
        remarks += (
            f"Changed by more than any error of manufacture: {', '.join(large)}. Compare the nominal values with those of the controller "
            "before any is entered.",
        )
    if left:
        remarks += (f"Not in the table, for they do not move the point '{target}': {', '.join(left)}.",)
    base, *joints, tool = (
        (
            name,
            {
                "type": kind,
                "nominal": was,
                "calibrated": now,
                "std": _known(spread, keys),
                "undetermined": sorted(keys),
            },
        )
        for (name, kind, was), (_, _, now), spread, keys in zip(old, new, std, open_, strict=True)
    )
    return RenderedModel(
        text,
        _tool_map(text, convention, list(chain)),
        AT_REST,
        "#",
        about=(
            *_SAYS[convention],
            "q adds to theta, or to d of a prismatic joint. The rows base and tool are Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll): "
            f"from the robot's base to the first frame, and from the last frame to the point '{target}'.",
            "std: what the uncertainty of the calibrated parameters makes of each. determined: no where the measured points leave it open.",
        ),
        remarks=remarks,
        table={
            "convention": convention,
            "safe": not large,
            "joints": dict(joints),
            "base": base[1],
            "tool": tool[1],
        },
        point=target,
    )


def dh_transforms(
    text: str, convention: Convention, column: str = "calibrated"
) -> Callable[[np.ndarray], np.ndarray]:
    """Forward kinematics of a table's `text`: positions (N, m) of its joints, rad or m, to frames (N, 4, 4)."""
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows_of(text):
        rows.setdefault((row["joint"], row["type"]), {})[row["parameter"]] = float(row[column])
    base, tool = (from_xyz_rpy(rows[name, "fixed"]) for name in ("base", "tool"))
    joints = [(kind, row) for (_, kind), row in rows.items() if kind != "fixed"]

    def frames(q: np.ndarray) -> np.ndarray:
        at = np.broadcast_to(base, (len(q), 4, 4))
        for (kind, row), moved in zip(joints, q.T, strict=True):
            turn = row["theta"] + moved * (kind == "revolute")
            shift = row["d"] + moved * (kind == "prismatic")
            joint = turned(Z, turn) @ shifted(Z, shift)
            link = shifted(X, row["a"]) @ turned(X, row["alpha"]) @ turned(Y, row["beta"])
            at = at @ (joint @ link if convention == "standard" else link @ joint)
        return at @ tool

    return frames


def _tool_map(text: str, convention: Convention, chain: list[int]) -> ToolMap:
    frames = dh_transforms(text, convention)
    return lambda q: frames(q[:, chain])[:, :3, 3]


def _rows(chain: DhChain, names: list[tuple[str, str]], convention: Convention) -> list[Row]:
    own = {key: getattr(chain, key) for key in _ORDER[convention]}
    if convention == "modified":
        own |= {key: np.concatenate([[0.0], own[key][:-1]]) for key in ("a", "alpha", "beta")}
    rows: list[Row] = [("base", "fixed", xyz_rpy(chain.base))]
    rows += [
        (name, kind, {key: float(values[k]) + 0.0 for key, values in own.items()})
        for k, (name, kind) in enumerate(names)
    ]
    return [*rows, ("tool", "fixed", xyz_rpy(chain.tool))]


def _std(
    model: RobotModel, rows: list[Row], parameter_rows: Callable[[RobotModel], list[Row]]
) -> list[dict[str, float] | None]:
    """Standard deviations of the joints' `rows`; None for base and tool, and where nothing was estimated."""

    def change(changed: RobotModel) -> np.ndarray:
        differences = []
        for (_, _, now), (_, _, was) in zip(parameter_rows(changed)[1:-1], rows[1:-1], strict=True):
            differences += [_difference(key, now[key], was[key]) for key in was]
        return np.array(differences)

    spread = np.linalg.norm(propagated_covariance_root(model, change), axis=1)
    if not spread.any():
        return [None] * len(rows)
    values = iter(spread.tolist())
    return [None, *({key: next(values) for key in row} for _, _, row in rows[1:-1]), None]


def _undetermined(
    std: list[dict[str, float] | None], unseen: list[dict[str, float] | None]
) -> list[dict[str, float]]:
    """Parameters of every row whose standard deviation is mostly due to what the measured points leave undetermined, with that."""
    return [
        {key: open_[key] for key in row if open_[key] > _MOSTLY * row[key] and open_[key] > 0}
        if row and open_
        else {}
        for row, open_ in zip(std, unseen, strict=True)
    ]


def _known(std: dict[str, float] | None, undetermined: dict[str, float]) -> dict[str, float | None] | None:
    """Standard deviations, None for undetermined parameters."""
    return (
        None if std is None else {key: None if key in undetermined else value for key, value in std.items()}
    )


def _large(old: list[Row], new: list[Row]) -> list[str]:
    """Parameters of joints that changed by more than a calibration should change them."""
    return [
        f"{key} of {name} by {abs(change):.3g} {UNITS[key]}"
        for (name, _, was), (_, _, now) in zip(old[1:-1], new[1:-1], strict=True)
        for key in now
        if abs(change := _difference(key, now[key], was[key])) > _LARGE[UNITS[key]]
    ]


def _difference(key: str, one: float, other: float) -> float:
    change = one - other
    return math.remainder(change, 2 * math.pi) if UNITS[key] == "rad" else change


def _csv(
    nominal: list[Row],
    calibrated: list[Row],
    std: list[dict[str, float] | None],
    undetermined: list[dict[str, float]],
) -> str:
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for (name, kind, old), (_, _, new), spread, open_ in zip(
        nominal, calibrated, std, undetermined, strict=True
    ):
        for key in new:
            change = repr(_difference(key, new[key], old[key]))
            known = "" if spread is None or key in open_ else repr(spread[key])
            told = "" if spread is None else "no" if key in open_ else "yes"
            writer.writerow(
                [name, kind, key, UNITS[key], repr(old[key]), repr(new[key]), change, known, told]
            )
    return stream.getvalue()


def _remarks(before: DhChain, after: DhChain, names: list[str], four: bool) -> tuple[str, ...]:
    sentences = []
    for k in range(len(names) - 1):
        if nominal_angle(before, k) >= NEARLY_PARALLEL:
            continue
        pair = f"The axes of {names[k]} and {names[k + 1]} are nearly parallel"
        if not four:
            sentences.append(
                f"{pair}: their row has beta, and d stays nominal; take --four-parameters where beta cannot be entered."
            )
        else:
            sentences.append(
                f"{pair}: their common normal is far away or nowhere, so d stays nominal, and what they are tilted about y is left out."
            )
    return tuple(sentences)
