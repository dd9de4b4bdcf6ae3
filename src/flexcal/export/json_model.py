"""Complete calibrated robot as one JSON document."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from flexcal.export.following_joints import followed_joints
from flexcal.export.representation_error import ToolMap, tool_positions
from flexcal.export.transforms import transform
from flexcal.export.written_file import RenderedModel
from flexcal.model.kinematics import bearing_placement, link_placement, point_placement
from flexcal.model.parts import LoopEnd, rotation_wxyz, vector_rotation
from flexcal.model.robot import HYSTERESIS, LATERAL, RATIO, RobotModel, ratio_errors, unit_in

FORMAT = "flexcal robot"
VERSION = 1


def render_json(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    """The robot as a JSON document (docs/file-formats.md); read back, its `parameters` make the calibrated robot of the nominal one."""
    joints = model.joints
    names = [None if joint.parent < 0 else joints[joint.parent].name for joint in joints]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "robot": model.name,
        "units": "SI: m, rad, kg, s, N",
        "gravity": model.gravity.tolist(),
        "joints": [_joint(model, i, parent) for i, parent in enumerate(names)],
        "relations": _relations(model),
        "points": {name: _point(model, name) for name in model.points},
        "payload": _payload(model),
        "stations": {
            name: {"instrument_from_base": _placement(place[:3], vector_rotation(place[3:]))}
            for name, place in zip(model.stations.names, model.stations.pose, strict=True)
        },
        "parameters": {name: _quantity(model, name) for name in model.values},
    }
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    return RenderedModel(text, _tool_map(text, nominal) if model.points else np.zeros_like, (), None)


def _tool_map(text: str, nominal: RobotModel) -> ToolMap:
    parameters = json.loads(text)["parameters"]
    values = {name: entry["value"] for name, entry in parameters.items() if entry["value"] is not None}
    read = nominal.with_values(values)
    return lambda q: tool_positions(read, q)[0]


def _joint(model: RobotModel, i: int, parent: str | None) -> dict[str, Any]:
    joint, inertia = model.joints[i], model.inertias[i]
    spring = next((e for e in model.elastic if e.index == i), None)
    ratio = float(model.drives.ratio[i])
    return {
        "name": joint.name,
        "link": joint.link,
        "parent": parent,
        "type": joint.kind,
        "axis": joint.axis.tolist(),
        "placement": _placement(*link_placement(model, i)),
        "limits": {
            key: value if np.isfinite(value := getattr(joint, key)) else None
            for key in ("lower", "upper", "velocity", "effort")
        },
        "backlash": _quantity(model, f"{joint.name}.backlash"),
        HYSTERESIS: _quantity(model, f"{joint.name}.{HYSTERESIS}"),
        "gravity_compliance": _quantity(model, f"{joint.name}.gravity_compliance"),
        "lateral_compliance": [_quantity(model, f"{joint.name}.{key}") for key in LATERAL],
        "transmission": [
            {"order": order}
            | {key: _quantity(model, f"{joint.name}.transmission_{order}_{key}") for key in ("sin", "cos")}
            for order in model.drives.harmonics
        ],
        "ratio_error": {
            model.joint_names[k]: _quantity(model, f"{joint.name}.{RATIO}{model.joint_names[k]}")
            for k in ratio_errors(model, i)
        },
        "springs": None
        if spring is None
        else {
            "frame": bearing_placement(model, spring).tolist(),
            "bearings": model.bearings,
            **{
                ("bearing_x", "bearing_y", "drive")[c]: {
                    kind: _quantity(model, f"{joint.name}.{('bearing_x', 'bearing_y', 'drive')[c]}.{kind}")
                    for kind in ("stiffness", "damping")
                }
                for c in spring.components
            },
        },
        "drive": {
            key: _quantity(model, f"{joint.name}.{key}")
            for key in ("rotor_inertia", "viscous", "coulomb", "torque_offset")
        }
        | {"ratio": ratio if np.isfinite(ratio) else None},
        "inertial": {
            "mass": _quantity(model, f"{joint.link}.mass"),
            "com": inertia.com.tolist(),
            "inertia_about_com": inertia.inertia.tolist(),
        },
    }


def _relations(model: RobotModel) -> dict[str, Any] | None:
    relations, names = model.relations, model.joint_names
    if relations is None:
        return None

    def end(at: LoopEnd) -> dict[str, Any]:
        return {
            "joint": None if at.joint < 0 else names[at.joint],
            "placement": _placement(at.translation, at.rotation),
        }

    return {
        "motors": list(model.motor_names),
        "linear": [
            {"joint": names[i], "of": {names[j]: ratio for j, ratio in of.items()}, "offset": offset}
            for i, (of, offset) in followed_joints(model).items()
        ],
        "loops": [
            {
                "name": loop.name,
                "a": end(loop.a),
                "b": end(loop.b),
                "ground": None if loop.ground < 0 else names[loop.ground],
                "passive": {names[i]: float(at) for i, at in zip(loop.passive, loop.start, strict=True)},
                "directions": loop.rows.tolist(),
                "errors": {key: _quantity(model, f"loop.{loop.name}.{key}") for key in loop.errors},
            }
            for loop in relations.loops
        ],
    }


def _point(model: RobotModel, name: str) -> dict[str, Any]:
    carrier, position, rotation = point_placement(model, name)
    return {"joint": model.joints[carrier].name, "placement": _placement(position, rotation)}


def _payload(model: RobotModel) -> dict[str, Any] | None:
    payload = model.payload
    if payload is None:
        return None
    own = payload.carried(payload.mass)
    return {
        "joint": model.joints[payload.joint].name,
        "mass": _quantity(model, "payload.mass"),
        "com": own.com.tolist(),
        "inertia_about_com": own.inertia.tolist(),
    }


def _placement(position: np.ndarray, rotation: np.ndarray) -> dict[str, Any]:
    return {
        "matrix": transform(position, rotation).tolist(),
        "xyz": position.tolist(),
        "quaternion_xyzw": np.roll(rotation_wxyz(rotation), -1).tolist(),
    }


def _quantity(model: RobotModel, name: str) -> dict[str, Any]:
    """Value, unit and standard deviation of a parameter; null if unknown or not estimated."""
    value = model.value(name)
    std = None
    posterior = model.posterior
    if posterior.determines(name):
        item = posterior.parameters[name]
        slope = value if item.scale == "log" else 1.0
        std = float(slope * np.sqrt(posterior.marginal([name])[0, 0]))
    return {"value": value if np.isfinite(value) else None, "unit": unit_in(model, name), "std": std}
