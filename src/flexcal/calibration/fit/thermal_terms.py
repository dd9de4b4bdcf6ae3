"""Parameters of the terms by which the robot changes with a measured temperature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import link_vectors, point_ends
from flexcal.model.robot import (
    EXPANSION,
    LINK_EXPANSION,
    REFERENCE,
    STATION_DRIFT,
    ZERO_DRIFT,
    RobotModel,
)

THERMAL = ("thermal", "thermal_links", ZERO_DRIFT, "thermal_stations")
"""Terms of temperature: expansion of the arm, of its links each, drift of joint zeros, shift of the instruments."""
_SHORT = 0.05
"""Length of a link, relative to the reach, below which its own expansion matters to nobody."""
_STEP = 0.1
"""Step, K, to which a reference temperature is rounded."""

_PLAUSIBLE = {
    EXPANSION.rpartition(".")[2]: 2e-5,
    LINK_EXPANSION: 1e-5,
    ZERO_DRIFT: 1e-5,
    **dict.fromkeys(STATION_DRIFT, 1e-5),
}


def plausible_thermal_size(key: str) -> float | None:
    """Plausible size (1σ) of a parameter of these terms by its key; None for others.

    Expansion 20 µm/(m K), between steel and aluminium, that of a link beside the arm's half of it; drift of a joint 10 µrad/K, and of an
    instrument 10 µm/K.
    """
    return _PLAUSIBLE.get(key)


def is_thermal(name: str) -> bool:
    """Whether a parameter is one of these terms'."""
    return name.rpartition(".")[2] in _PLAUSIBLE and name != REFERENCE


def with_reference_temperature(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot whose parameters hold at the declared temperature, else at the mean of the poses, to 0.1 K."""
    if poses.temperature is None or np.isfinite(model.thermal.reference[0]):
        return model
    mean = round(float(poses.temperature.mean()) / _STEP) * _STEP
    return replace(model, thermal=replace(model.thermal, reference=np.array([round(mean, 6)])))


def thermal_parameters(model: RobotModel, poses: PoseSet, term: str, joints: Sequence[int]) -> list[str]:
    """Names of the parameters of one of the terms `THERMAL`, or of `<joint>.thermal_drift`, on some poses and their moving `joints`.

    `thermal_links` has the arm's coefficient, which is then that of its longest link, and what those of other long links are beside it.
    Raises `FlexcalError` without measured temperatures that differ, and for expansion of single links of a robot whose joints follow
    others.
    """
    if poses.temperature is None or not np.ptp(poses.temperature) > 0:
        what = "have no temperature" if poses.temperature is None else "all have the same temperature"
        raise FlexcalError(
            "E-CAL-034",
            f"the poses {what}, so the term {term} cannot be fitted; give a column 'temperature' (°C) with poses at several temperatures, "
            "or leave the term out.",
        )
    owner, _, kind = term.rpartition(".")
    names = model.joint_names
    if kind == ZERO_DRIFT:
        chosen = [model.joint_index(owner)] if owner else [i for i in joints if i in model.motors]
        return [f"{names[i]}.{ZERO_DRIFT}" for i in chosen]
    if kind == "thermal_stations":
        stations = dict.fromkeys(poses.station[poses.located].tolist())
        return [f"station.{name}.{key}" for name in stations for key in STATION_DRIFT]
    if kind == "thermal_links":
        model.require_motors("links that expand each by themselves")
        return [
            EXPANSION,
            *(f"{model.joints[i].link}.{LINK_EXPANSION}" for i in _other_links(model, poses, joints)),
        ]
    return [EXPANSION]


def _other_links(model: RobotModel, poses: PoseSet, joints: Sequence[int]) -> list[int]:
    """Those of the `joints` whose links are long enough to matter, without the longest."""
    lengths = np.zeros(len(model.joints))
    for target, end in point_ends(model, poses.target).items():
        vectors = link_vectors(model, poses.q[poses.target == target], end)
        lengths = np.maximum(lengths, np.linalg.norm(vectors, axis=2).mean(axis=0))
    longest = int(lengths.argmax())
    return [i for i in joints if lengths[i] > _SHORT * model.reach and i != longest]
