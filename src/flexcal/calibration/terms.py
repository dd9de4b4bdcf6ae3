"""Which parameters a calibration estimates: the kinematic 47 and the terms beyond them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.data import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model import RobotModel
from flexcal.model.names import GEOMETRY, unit_of

TOLERANCE = {"m": 3e-4, "rad": 5e-4, "rad/(N m)": 1e-6}
"""Size of a change that matters (1σ of manufacture), by unit: what makes parameters of different units comparable."""


def geometric_parameters(model: RobotModel, poses: PoseSet, terms: Sequence[str]) -> Parameters:
    """The geometric parameters of some terms, starting at the model's values (P1 §3).

    `kinematic`: a place for every station, and a rotation for all but the first, whose rotation the first joint's errors span; six
    errors for every joint that moves a measured target, six for the tool, three for each further target. `backlash`: the joints declared
    with it. `gravity_compliance`, `transmission_1`…: one or two for every revolute joint on the way.
    """
    joints = _moving(model, poses)
    names: list[str] = []
    for k, station in enumerate(dict.fromkeys(poses.station)):
        names += [f"station.{station}.{key}" for key in ("x", "y", "z")]
        names += [f"station.{station}.{key}" for key in ("rx", "ry", "rz")] if k else []
    for i in joints:
        names += [f"{model.joints[i].name}.{key}" for key in GEOMETRY]
    names += [f"tool.{key}" for key in GEOMETRY]
    first = next(iter(model.points))
    names += [f"point.{t}.{key}" for t in dict.fromkeys(poses.target) if t != first for key in "xyz"]
    items = [_parameter(model, name) for name in names if "kinematic" in terms]
    if "backlash" in terms:
        items += [
            _parameter(model, f"{model.joints[i].name}.backlash", lower=0.0)
            for i in model.backlash_joints
            if i in joints
        ]
    for term in terms:
        for i in joints:
            if model.joints[i].kind != "revolute":
                continue
            owner = model.joints[i].name
            if term == "gravity_compliance":
                items.append(_parameter(model, f"{owner}.gravity_compliance"))
            elif term.startswith("transmission_"):
                items += [_parameter(model, f"{owner}.{term}_{wave}") for wave in ("sin", "cos")]
    return Parameters(items)


def tolerances(parameters: Parameters) -> np.ndarray:
    """Size of a change that matters in each geometric parameter (p,), natural units."""
    return np.array([TOLERANCE[p.unit] for p in parameters])


def _parameter(model: RobotModel, name: str, lower: float = -np.inf) -> Parameter:
    return Parameter(name, unit_of(name), model.value(name), lower=lower)


def _moving(model: RobotModel, poses: PoseSet) -> list[int]:
    """Joints between the base and any measured target, in chain order."""
    found: set[int] = set()
    for target in dict.fromkeys(poses.target):
        joint = model.point(target).joint
        while joint >= 0:
            found.add(joint)
            joint = model.joints[joint].parent
    return sorted(found)
