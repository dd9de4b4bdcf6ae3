"""The table of joint offsets, and its reader."""

from __future__ import annotations

import csv
from collections.abc import Collection
from io import StringIO

import numpy as np

from flexcal.export.chain import motors_to
from flexcal.export.offset_fit import OffsetFit, fit_offsets, offset_tool
from flexcal.export.representation_error import AT_REST, GEOMETRY, DrawPoses, ToolMap
from flexcal.export.transforms import XYZ_RPY, from_xyz_rpy, transform, xyz_rpy
from flexcal.export.written_file import RenderedModel, rows_of
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE, MILLIMETRE

COLUMNS = ("joint", "parameter", "unit", "value", "std", "value_deg", "motor_deg", "determined")
_LARGE = 5 * DEGREE
"""Offset above which it is rather a different zero in the URDF than an error."""


def render_offsets(
    model: RobotModel,
    nominal: RobotModel,
    *,
    point: str | None = None,
    keep_frames: bool = False,
    undetermined: Collection[int] = (),
    draw: DrawPoses | None = None,
) -> RenderedModel:
    """The best joint offsets as a CSV table, with base and tool that go with them unless `keep_frames`; zero for the joints `undetermined`.

    The poses are those of `draw`, as `poses_of` takes it.
    Raises `FlexcalError` for a robot without points, or an unknown point.
    """
    target, motors = motors_to(model, point, "Joint offsets")
    fit = fit_offsets(model, nominal, target, keep_frames=keep_frames, undetermined=undetermined, draw=draw)
    text = _csv(model, fit, motors, keep_frames=keep_frames)
    remarks = []
    if keep_frames:
        remarks.append(
            f"Without offsets, its base and point as they are, the nominal robot is off by {fit.before.mean / MILLIMETRE:.3f} mm on "
            f"average, {fit.before.max / MILLIMETRE:.3f} mm at most."
        )
    open_ = [model.motor_names[k] for k in motors if not fit.determined[k]]
    if open_:
        remarks.append(
            f"Not determined, and zero here: {', '.join(open_)}. What was measured cannot tell their zeros from another place of the "
            "base or of the measured point on the tool; leave these zeros as they are."
        )
    large = [
        model.motor_names[k]
        for k in motors
        if abs(fit.offsets[k]) > _LARGE and model.motor_joints[k].kind != "prismatic"
    ]
    if large:
        remarks.append(
            f"Larger than any error of manufacture: {', '.join(large)}. Look whether URDF and controller have the same zeros before "
            "entering any."
        )
    left = [name for k, name in enumerate(model.motor_names) if k not in motors]
    if left:
        remarks.append(
            f"Without an offset here, for they do not move the point '{target}': {', '.join(left)}."
        )
    if model.config.drives.coupling:
        remarks.append(
            "Values at the motor are by its own ratio alone: couplings between motors are not in them."
        )
    frames = (
        ()
        if keep_frames
        else (
            "base: Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll) of the controller's base frame in that of the calibrated robot; "
            f"tool: what to add to the point '{target}' in its frame.",
        )
    )
    ratios = model.drives.ratio[list(model.motors)]
    document = {
        model.motor_names[k]: {
            "offset": float(fit.offsets[k]),
            "unit": "m" if model.motor_joints[k].kind == "prismatic" else "rad",
            "std": float(fit.std[k]) if fit.determined[k] and fit.std[k] > 0 else None,
            "determined": bool(fit.determined[k]),
            "motor_offset": float(fit.offsets[k] * ratios[k]) if np.isfinite(ratios[k]) else None,
        }
        for k in motors
    }
    return RenderedModel(
        text,
        _tool_map(text, nominal, target),
        (GEOMETRY, *AT_REST),
        "#",
        about=(
            "Joint offsets: with the joints at q, the nominal robot at q + offset is nearest to the real one. "
            "Least squares over random poses; no other geometry is changed.",
            *frames,
            "determined: no for an offset that the measured points do not determine, which is left at zero.",
            "std: what the uncertainty of the calibrated parameters leaves. motor_deg: at the motor, by drives: ratio of robot.yaml.",
        ),
        remarks=tuple(remarks),
        table={
            "joints": document,
            "safe": not large,
            "without_offsets": fit.before.in_millimetres(),
            "base": None if keep_frames else _base_numbers(fit.base),
            "tool": None if keep_frames else dict(zip("xyz", fit.tool.tolist(), strict=True)),
        },
        point=target,
    )


def offsets_of(text: str, nominal: RobotModel) -> np.ndarray:
    """Parameters (n + 9,) of `offset_tool` that a table's `text` holds; raises `FlexcalError` for a joint that the robot does not have."""
    parameters = np.zeros(nominal.n + 9)
    pose: dict[str, float] = dict.fromkeys(XYZ_RPY, 0.0)
    for row in rows_of(text):
        value = float(row["value"])
        if row["parameter"] == "offset":
            nominal.joint_index(row["joint"])
            parameters[nominal.motor_names.index(row["joint"])] = value
        elif row["joint"] == "tool":
            parameters[nominal.n + 6 + "xyz".index(row["parameter"])] = value
        else:
            pose[row["parameter"]] = value
    base = from_xyz_rpy(pose)
    parameters[nominal.n : nominal.n + 3] = base[:3, 3]
    parameters[nominal.n + 3 : nominal.n + 6] = rotation_vector(base[:3, :3])
    return parameters


def _tool_map(text: str, nominal: RobotModel, point: str) -> ToolMap:
    parameters = offsets_of(text, nominal)
    return lambda q: offset_tool(nominal, q, parameters, point)


def _base_numbers(base: np.ndarray) -> dict[str, float]:
    return xyz_rpy(transform(base[:3], vector_rotation(base[3:])))


def _csv(model: RobotModel, fit: OffsetFit, motors: tuple[int, ...], *, keep_frames: bool) -> str:
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for i in motors:
        joint, value = model.motor_joints[i], float(fit.offsets[i])
        std = repr(float(fit.std[i])) if fit.determined[i] and fit.std[i] > 0 else ""
        told = "yes" if fit.determined[i] else "no"
        if joint.kind == "prismatic":
            writer.writerow([joint.name, "offset", "m", repr(value), std, "", "", told])
            continue
        at_motor = value * model.drives.ratio[model.motors[i]] / DEGREE
        motor = f"{at_motor:.6f}" if np.isfinite(at_motor) else ""
        writer.writerow([joint.name, "offset", "rad", repr(value), std, f"{value / DEGREE:.6f}", motor, told])
    if not keep_frames:
        for key, value in _base_numbers(fit.base).items():
            angle = key in XYZ_RPY[3:]
            degrees = f"{value / DEGREE:.6f}" if angle else ""
            writer.writerow(["base", key, "rad" if angle else "m", repr(value), "", degrees, "", ""])
        for key, value in zip("xyz", fit.tool.tolist(), strict=True):
            writer.writerow(["tool", key, "m", repr(value), "", "", "", ""])
    return stream.getvalue()
