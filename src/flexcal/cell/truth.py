"""The hidden truth: a robot drawn around the nominal one, and its file, which only the final comparison opens."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexcal.cell.config import SpreadConfig
from flexcal.model import RobotModel
from flexcal.model.names import GEOMETRY


def draw_truth(model: RobotModel, spread: SpreadConfig, rng: np.random.Generator) -> dict[str, float]:
    """Named true values (SI, FORMATS) of a robot around the nominal `model`.

    Drawn are link masses, centres of mass, rotor inertias, all geometric errors with tool and first station, half gaps of the joints
    that declare backlash, stiffness and damping of every spring; `model.with_values` gives the true robot, whose link inertias
    follow the masses. Friction stays as declared.
    """
    return dict(_draws(model, spread, rng))


def _draws(model: RobotModel, spread: SpreadConfig, rng: np.random.Generator) -> Iterator[tuple[str, float]]:
    normal = rng.standard_normal
    for i, joint in enumerate(model.joints):
        yield f"{joint.link}.mass", model.mass[i] * (1 + spread.mass * normal())
        for k, key in enumerate("xyz"):
            yield f"{joint.link}.com_{key}", model.com[i, k] + spread.com * normal()
        if np.isfinite(model.rotor_inertia[i]):
            yield (
                f"{joint.name}.rotor_inertia",
                model.rotor_inertia[i] * (1 + spread.rotor_inertia * normal()),
            )
    for owner, values in (*zip(model.joint_names, model.geometry, strict=True), ("tool", model.tool)):
        for k, key in enumerate(GEOMETRY):
            scale = spread.length if key.startswith("length") else spread.angle
            yield f"{owner}.{key}", values[k] + scale * normal()
    for k, key in enumerate("xyz"):
        yield f"station.{model.stations[0]}.{key}", model.station[0, k] + spread.length * normal()
    for i in model.backlash_joints:
        yield f"{model.joint_names[i]}.backlash", rng.uniform(*spread.backlash)
    for spring in model.elastic:
        for component in spring.components:
            name = f"{spring.name}.{('bearing_x', 'bearing_y', 'drive')[component]}"
            yield f"{name}.stiffness", spring.stiffness[component] * np.exp(spread.stiffness * normal())
            yield f"{name}.damping", spring.damping[component] * np.exp(spread.damping * normal())
