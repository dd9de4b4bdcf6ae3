"""True parameters of the virtual robot, drawn about the nominal ones, and their file."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from flexcal.files.formats import BLOCKS, Block, YamlFile, read_yaml_file, write_yaml
from flexcal.files.structuring import Keys, suggestion
from flexcal.model.robot import GEOMETRY, NUISANCE, REFERENCE, SPRINGS, STATION, RobotModel, unit_of
from flexcal.virtual_cell.config import SpreadConfig

_LARGEST = 1e12
"""Largest value in SI units, far above the stiffest spring."""
_POSITIVE = (".mass", ".rotor_inertia", ".stiffness")
_NOT_NEGATIVE = (".damping", ".backlash", ".viscous", ".coulomb")


def draw_truth(model: RobotModel, spread: SpreadConfig, rng: np.random.Generator) -> dict[str, float]:
    """Draw the true parameters of a robot around those of a nominal one.

    Drawn are link masses, centres of mass, rotor inertias, all geometric errors with tool and first station, half gaps of the
    joints that declare backlash, stiffness and damping of every spring. Link inertias follow the masses; friction stays as
    declared.

    Parameters
    ----------
    model : RobotModel
        Nominal robot.
    spread : SpreadConfig
        Standard deviations of the parameters.
    rng : numpy.random.Generator
        Source of the random numbers.

    Returns
    -------
    dict of float
        True values by name, SI units; `model.with_values` gives the true robot.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import CellConfig, RobotModel, draw_truth
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> values = draw_truth(model, CellConfig().spread, np.random.default_rng(0))
    >>> truth = model.with_values(values)
    >>> bool(truth.value("link_3.mass") == values["link_3.mass"])
    True
    """
    return dict(_draws(model, spread, rng))


def _draws(model: RobotModel, spread: SpreadConfig, rng: np.random.Generator) -> Iterator[tuple[str, float]]:
    normal = rng.standard_normal
    for i, joint in enumerate(model.joints):
        yield f"{joint.link}.mass", model.links.mass[i] * (1 + spread.mass * normal())
        for k, key in enumerate("xyz"):
            yield f"{joint.link}.com_{key}", model.links.com[i, k] + spread.com * normal()
        if np.isfinite(model.drives.rotor_inertia[i]):
            yield (
                f"{joint.name}.rotor_inertia",
                model.drives.rotor_inertia[i] * (1 + spread.rotor_inertia * normal()),
            )
    for owner, values in (
        *zip(model.joint_names, model.geometry.errors, strict=True),
        ("tool", model.geometry.tool),
    ):
        for k, key in enumerate(GEOMETRY):
            scale = spread.length if key.startswith("length") else spread.angle
            yield f"{owner}.{key}", values[k] + scale * normal()
    for k, key in enumerate("xyz"):
        yield f"station.{model.stations.names[0]}.{key}", model.stations.pose[0, k] + spread.length * normal()
    for i in model.backlash_joints:
        yield f"{model.joint_names[i]}.backlash", rng.uniform(*spread.backlash)
    for spring in model.elastic:
        for component in spring.components:
            name = f"{spring.name}.{SPRINGS[component]}"
            yield f"{name}.stiffness", spring.stiffness[component] * np.exp(spread.stiffness * normal())
            yield f"{name}.damping", spring.damping[component] * np.exp(spread.damping * normal())


def write_truth(path: str | Path, values: Mapping[str, float]) -> None:
    """Write true values, atomically, as values with units in the blocks of an estimates.yaml; floats come back bit by bit.

    A robot that temperature does not change has no reference temperature (NaN), and the file none.
    """
    blocks: dict[Block, dict[str, dict[str, object]]] = {}
    for block in BLOCKS:
        named = {
            name: value
            for name, value in values.items()
            if _block(name) == block and not (name == REFERENCE and math.isnan(value))
        }
        entries: dict[str, object] = {
            name: {"estimate": float(value), "unit": unit_of(name)} for name, value in named.items()
        }
        if entries:
            blocks[block] = {"values": entries}
    write_yaml(path, blocks)


def _block(name: str) -> Block:
    """Block of the identification that estimates a parameter."""
    owner, _, last = name.rpartition(".")
    if owner == "payload":
        return "payload"
    if last in ("stiffness", "damping"):
        return "stiffness"
    return "calibration" if last in (*GEOMETRY, *STATION, "backlash") else "dynamics"


def read_truth(path: str | Path) -> dict[str, float]:
    """The values of all blocks of a file in the form of estimates.yaml; a value may also be a plain number, and the blocks be left out.

    Of a name in several blocks the last counts; names of one pose of an experiment (`.pose_1`) are left out. Raises `InputError` with
    file and line for anything else.
    """
    return {name: value for name, (value, _) in _entries(read_yaml_file(path)).items()}


def read_truth_of(path: str | Path, model: RobotModel) -> dict[str, float]:
    """`read_truth` of a file from outside, for a robot: what the file lacks of its parameters is as in `model`, and the log says so.

    Raises `InputError` with file and line for a name that the robot does not have and a value that it cannot have.
    """
    file = read_yaml_file(path)
    entries = _entries(file)
    for name, (value, keys) in entries.items():
        if name not in model.values:
            hint = suggestion(name, list(model.values)) or "; give the truth of this robot."
            raise file.error("E-CELL-030", keys, f"{model.path} has no parameter '{name}'{hint}")
        if value <= 0 if name.endswith(_POSITIVE) else value < 0 and name.endswith(_NOT_NEGATIVE):
            raise file.error(
                "E-CELL-031",
                keys,
                f"the true value of '{name}' is {value:g}, which is not possible; correct it.",
            )
    values = {name: value for name, (value, _) in entries.items()}
    drawn = draw_truth(model, SpreadConfig(), np.random.default_rng(0))
    lacking = [name for name in drawn if name not in values]
    if lacking:
        more = f" and {len(lacking) - 1} others" if len(lacking) > 1 else ""
        logging.getLogger("flexcal.virtual_cell").warning(
            f"{path}: '{lacking[0]}'{more} are missing and taken as in {model.path}"
        )
    return {name: model.value(name) for name in lacking} | values


def _entries(file: YamlFile) -> dict[str, tuple[float, Keys]]:
    """Value and place of every name."""
    if not isinstance(file.data, Mapping) or not file.data:
        raise file.error(
            "E-CELL-032", (), "a truth file holds parameter names and values; this one does not."
        )
    entries: dict[str, tuple[float, Keys]] = {}
    for key, item in file.data.items():
        if not _is_block(item):
            entries[key] = (_value(file, (key,), item), (key,))
            continue
        table = item.get("values")
        if not isinstance(table, Mapping):
            raise file.error(
                "E-CELL-033",
                (key,),
                f"the block '{key}' has no `values:` table; add one of names and numbers.",
            )
        for name, entry in table.items():
            keys = (key, "values", name)
            entries[name] = (_value(file, keys, entry), keys)
    return {name: entry for name, entry in entries.items() if not NUISANCE.fullmatch(name)}


def _is_block(item: object) -> bool:
    return isinstance(item, Mapping) and "estimate" not in item


def _value(file: YamlFile, keys: Keys, entry: object) -> float:
    value = entry.get("estimate") if isinstance(entry, Mapping) else entry
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
        raise file.error(
            "E-CELL-034",
            keys,
            f"the true value of '{keys[-1]}' is not a number; write one, or `{{estimate: 1.0}}`.",
        )
    return float(value)
