"""Calibrated robot for the C++ runtime: the numbers of its compensation as one JSON document, or as a header with that."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.representation_error import ToolMap
from flexcal.export.written_file import RenderedModel
from flexcal.kernels import RuntimeRobot
from flexcal.model.kinematics import point_placement
from flexcal.model.parts import bearing_frame
from flexcal.model.robot import RobotModel

FORMAT = "flexcal runtime"
VERSION = 1
_POSE = 6


def render_runtime(
    model: RobotModel,
    nominal: RobotModel,
    drives: Mapping[str, Any],
    *,
    holds: Mapping[str, np.ndarray] | None = None,
    header: bool = False,
) -> RenderedModel:
    """The `model` that the robot really is, and the `nominal` one that says where its tool is to be, as the runtime reads them.

    `drives` is the document of its `TorqueModel`; `holds` are the joint ranges (2, n), rad or m, within which the calibration holds, of the
    points at which it does not everywhere.
    With `header` the text is a C and C++ header with the document as the constant `flexcal_robot`.
    Raises `FlexcalError` for a robot without points, one whose joints follow others, and one that the runtime refuses.
    """
    model.require_motors("the runtime")
    model.point()
    payload = model.payload
    document = {
        "format": FORMAT,
        "version": VERSION,
        "robot": model.name,
        "units": "SI: m, rad, kg, N",
        "reach": model.reach,
        "gravity": model.gravity.tolist(),
        "tilts_first": model.bearings == "before",
        "joints": [_joint(model, nominal, i) | drives["joints"][i] for i in range(len(model.joints))],
        "couplings": drives["couplings"],
        "points": [_point(model, nominal, name, (holds or {}).get(name)) for name in model.points],
        "payload": None
        if payload is None
        else {
            "joint": payload.joint,
            "com": payload.com_in_link.tolist(),
            "mass": payload.mass,
            "scale": payload.mass / payload.nominal_mass if payload.nominal_mass else 1.0,
            "inertia": drives["payload_inertia"],
        },
    }
    try:
        text = json.dumps(document, indent=1, allow_nan=False) + "\n"
        robot = RuntimeRobot.read(text)
    except ValueError as problem:
        raise FlexcalError(
            "E-EXPORT-007",
            f"{model.name} is no robot that the runtime takes: {problem}; correct it in the URDF, robot.yaml or the estimates.",
        ) from problem
    return RenderedModel(_header(text) if header else text, _tool_map(robot), (), None)


def _tool_map(robot: RuntimeRobot) -> ToolMap:
    no_flank = np.zeros((0, len(robot.joint_names)))
    return lambda q: robot.forward(q, 0, np.full(len(q), np.nan), no_flank)[0]


def _header(text: str) -> str:
    """The document as a constant, line by line: compilers limit the length of one literal."""
    lines = [json.dumps(line + "\n").replace("?", "\\?") for line in text.splitlines()]  # no trigraphs
    return "\n".join(
        [
            "#pragma once",
            "",
            "static const char flexcal_robot[] =",
            *(f"    {line}" for line in lines[:-1]),
            f"    {lines[-1]};",
            "",
        ]
    )


def _joint(model: RobotModel, nominal: RobotModel, i: int) -> dict[str, Any]:
    joint, geometry, drives = model.joints[i], model.geometry, model.drives
    frame = model.springs.bearing_frames.get(i)
    return {
        "name": joint.name,
        "parent": joint.parent,
        "prismatic": joint.kind == "prismatic",
        "rotation": joint.rotation.ravel().tolist(),
        "translation": (joint.translation + geometry.origin_error[i]).tolist(),
        "nominal_translation": (joint.translation + nominal.geometry.origin_error[i]).tolist(),
        "normals": joint.normals.ravel().tolist(),
        "bearing": (bearing_frame(joint) if frame is None else frame).ravel().tolist(),
        "errors": geometry.errors[i].tolist(),
        "nominal_errors": nominal.geometry.errors[i].tolist(),
        "lower": _limit(joint.lower),
        "upper": _limit(joint.upper),
        "mass": float(model.links.mass[i]),
        "first_moment": (model.links.mass[i] * model.links.com[i]).tolist(),
        "springs": _springs(model, i),
        "backlash": float(drives.backlash[i]),
        "gravity_compliance": float(geometry.gravity_compliance[i]),
        "lateral_compliance": geometry.lateral_compliance[i].tolist(),
        "waves": [
            {"order": order, "sin": float(sine), "cos": float(cosine)}
            for order, (sine, cosine) in zip(drives.harmonics, drives.transmission[i], strict=True)
            if sine or cosine
        ],
        "ratio_errors": [
            {"joint": int(other), "ratio": float(drives.ratio_error[i, other])}
            for other in np.flatnonzero(drives.ratio_error[i])
        ],
    }


def _springs(model: RobotModel, i: int) -> list[dict[str, float]]:
    """Springs of a joint from base to tool; component 0 tilts about x, 1 about y, 2 is the drive's twist."""
    return [
        {"component": component, "stiffness": float(spring.stiffness[component])}
        | ({"hardening": float(model.springs.hardening[i])} if component == 2 else {})
        for spring in model.elastic
        if spring.index == i
        for component in spring.components
    ]


def _limit(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _point(model: RobotModel, nominal: RobotModel, name: str, holds: np.ndarray | None) -> dict[str, Any]:
    joint, position, rotation = point_placement(model, name)
    _, nominal_position, nominal_rotation = point_placement(nominal, name)
    whole = len(set(model.moving(joint)) & set(model.motors)) >= _POSE
    return {
        "name": name,
        "joint": joint,
        "rows": _POSE if whole else 3,
        "position": position.tolist(),
        "rotation": rotation.ravel().tolist(),
        "nominal_position": nominal_position.tolist(),
        "nominal_rotation": nominal_rotation.ravel().tolist(),
        "holds": None
        if holds is None
        else {
            end: [_limit(value) for value in row]
            for end, row in zip(("lower", "upper"), holds.tolist(), strict=True)
        },
    }
