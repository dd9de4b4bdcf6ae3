"""Actuators for Isaac Lab and PACE, as one JSON document."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from flexcal.export.actuators import Actuators
from flexcal.export.mujoco_spec import effort_limit
from flexcal.export.written_file import RenderedModel
from flexcal.model.robot import RobotModel

FORMAT = "flexcal actuators"
VERSION = 1
TIME_STEP = 0.005
"""Time step of the simulation, s, in which delays are counted by default: that of most of Isaac Lab's tasks."""


def render_isaac(model: RobotModel, actuators: Actuators, *, time_step: float = TIME_STEP) -> RenderedModel:
    """Keyword arguments of Isaac Lab's `DelayedPDActuatorCfg`, a group for every delay, and the vector of parameters of PACE.

    Numbers are in SI units of the joints (rad, not the degrees of USD). Static and dynamic friction are both the Coulomb friction: a
    torque from Isaac Sim 5.0 on. PACE's parameters (Bjelonic et al. 2025) are armature, viscous and Coulomb friction, bias of the encoder
    (0: no such bias was identified) of all joints, and one delay in time steps. Delays are rounded to whole steps of `time_step` s.
    """
    names = list(model.joint_names)
    steps = np.rint(actuators.delay / time_step).astype(int)
    groups = {
        f"delay_{count}": [i for i in range(len(names)) if steps[i] == count]
        for count in sorted(set(steps.tolist()))
    }
    document = {
        "format": FORMAT,
        "version": VERSION,
        "robot": model.name,
        "units": "SI: rad, m, N m, N, kg m², kg, s",
        "time_step_s": time_step,
        "velocity_targets": actuators.follows_velocity,
        "delay_s": {name: float(delay) for name, delay in zip(names, actuators.delay, strict=True)},
        "isaac_lab": {
            "class": "DelayedPDActuatorCfg",
            "actuators": {group: _group(model, actuators, joints, steps) for group, joints in groups.items()},
        },
        "pace": {
            "joint_order": names,
            "parameters": [
                *actuators.armature.tolist(),
                *actuators.viscous.tolist(),
                *actuators.coulomb.tolist(),
                *np.zeros(len(names)).tolist(),
                int(np.rint(np.median(steps))),
            ],
            "stiffness": dict(zip(names, actuators.stiffness.tolist(), strict=True)),
            "damping": dict(zip(names, actuators.damping.tolist(), strict=True)),
        },
    }
    largest = float(np.abs(steps * time_step - actuators.delay).max())
    remarks = [f"Delays are whole steps of {1e3 * time_step:g} ms, off by {1e3 * largest:.2g} ms at most."]
    if not actuators.viscous.any():
        remarks.append("Viscous friction is part of the damping, and 0 by itself.")
    if actuators.follows_velocity:
        remarks.append("The damping follows the commanded velocity: give velocity targets too.")
    return RenderedModel(
        json.dumps(document, indent=1, allow_nan=False) + "\n",
        None,
        (),
        None,
        remarks=tuple(remarks),
        table={"actuators": document["isaac_lab"], "time_step_s": time_step},
    )


def _group(model: RobotModel, actuators: Actuators, joints: list[int], steps: np.ndarray) -> dict[str, Any]:
    names = [model.joint_names[i] for i in joints]

    def of_each(values: np.ndarray) -> dict[str, float]:
        return {name: float(values[i]) for name, i in zip(names, joints, strict=True)}

    efforts = {name: effort_limit(model, i) for name, i in zip(names, joints, strict=True)}
    delay = int(steps[joints[0]])
    return {
        "joint_names_expr": names,
        "effort_limit": {name: effort for name, effort in efforts.items() if effort is not None},
        "stiffness": of_each(actuators.stiffness),
        "damping": of_each(actuators.damping),
        "armature": of_each(actuators.armature),
        "friction": of_each(actuators.coulomb),
        "dynamic_friction": of_each(actuators.coulomb),
        "viscous_friction": of_each(actuators.viscous),
        "min_delay": delay,
        "max_delay": delay,
    }
