"""The hidden truth: a robot drawn around the nominal one, and its file, which only the final comparison opens."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from flexcal.cell.config import SpreadConfig
from flexcal.model import RobotModel
from flexcal.model.names import GEOMETRY, unit_of
from flexcal.yaml_reader import read_yaml_file
from flexcal.yaml_writer import write_yaml


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


def write_truth(path: str | Path, values: Mapping[str, float]) -> None:
    """Write true values, atomically, in the form of estimates.yaml: one block `truth` with its `values`; floats come back bit by bit."""
    write_yaml(path, {"truth": {"values": dict(values), "units": {name: unit_of(name) for name in values}}})


def read_truth(path: str | Path) -> dict[str, float]:
    """Read true values: of every block of a file in the form of estimates.yaml, or a plain `name: value` table.

    Raises `InputError` with file and line for anything else.
    """
    file = read_yaml_file(path)
    if not isinstance(file.data, Mapping) or not file.data:
        raise file.error((), "a truth file holds parameter names and values; this one does not.")
    flat = not any(isinstance(block, Mapping) for block in file.data.values())
    tables: list[tuple[str, ...]] = [()] if flat else [(name, "values") for name in file.data]
    result: dict[str, float] = {}
    for keys in tables:
        table = file.data
        for key in keys:
            table = table.get(key) if isinstance(table, Mapping) else None
        if not isinstance(table, Mapping):
            raise file.error(
                keys[:1], f"the block '{keys[0]}' has no `values:` table; add one of names and numbers."
            )
        for name, value in table.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise file.error((*keys, name), f"the true value of '{name}' is not a number.")
            result[name] = float(value)
    return result
