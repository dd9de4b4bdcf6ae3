"""Constraints of physical consistency, and the prior of the parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flexcal.dynamics.inverse_model import Equations
from flexcal.dynamics.regression import TriangularFactor
from flexcal.estimation import Cone
from flexcal.model.parts import LINK_PARAMETERS, PSEUDO_INERTIA, Inertia, pseudo_inertia
from flexcal.model.robot import RobotModel

_LINK_FLOOR = 1e-3
_DRIVE_FLOOR = 1e-5
"""Lower bounds of a pseudo-inertia and of a drive parameter, relative to the reference."""
_MASS_BOUND = 3.0
"""Bound of a link's mass about its CAD mass, in prior standard deviations."""
_TIGHTEST = 1e-3
"""Least relative standard deviation of a prior, even if CAD counts as exact."""
_STEEL = 8000.0
"""Density, kg/m³; a link with less extent in CAD than a steel ball of its mass is replaced by that ball."""
_SILENT = 1e-9
"""Size of a column, relative to the largest of its kind, below which it is zero."""
_UNKNOWN_STD = 100.0
"""Relative standard deviation of a drive parameter without prior knowledge: very wide, keeps the problem well posed."""
_UNKNOWN_MASS, _UNKNOWN_RADIUS = 1.0, 0.05
"""Mass (kg) and radius (m) of a link unknown to both URDF and the other links."""


def feasible_set(observation: Equations, system: TriangularFactor) -> tuple[Cone, ...]:
    """Cones of all links and drives of an observation, whose weighted equations are `system`.

    A link's pseudo-inertia is positive definite (Sousa & Cortesão 2014; Wensing, Kim & Slotine 2018), with CAD as its reference and the
    prior's relative standard deviation of the mass; the CAD mass bounds its mass. Without one the reference is a ball as heavy as the
    average link and as wide as this one is long. Rotor inertia and viscous friction are positive, as matrices where motors turn with
    two joints; Coulomb friction, and stiffness and damping of springs, are positive. A drive parameter that robot.yaml does not give
    has hardly a prior, and as reference the least size at which one of its kind would be as large as all torques; one that the data do
    not depend on is left out.
    """
    return (*_links(observation.model), *_drives(observation, system))


def _links(model: RobotModel) -> Iterator[Cone]:
    std = max(model.prior.mass, _TIGHTEST)
    for i, link in enumerate(model.inertias):
        column_indices = np.arange(len(LINK_PARAMETERS) * i, len(LINK_PARAMETERS) * (i + 1))
        if link.mass > 0:
            yield Cone(column_indices, PSEUDO_INERTIA, pseudo_inertia(extended(link)), _LINK_FLOOR, 2.0 * std)
            yield _scalar(column_indices[0], link.mass, 1.0 - _MASS_BOUND * std, math.inf)
            yield _scalar(column_indices[0], link.mass, -1.0 - _MASS_BOUND * std, math.inf, sign=-1.0)
        else:
            yield Cone(column_indices, PSEUDO_INERTIA, pseudo_inertia(_guessed(model, i)), _LINK_FLOOR, 2.0)


def extended(link: Inertia) -> Inertia:
    """Link with principal extents at least those of a steel ball of its mass."""
    least = link.mass / 5.0 * (3.0 * link.mass / (4.0 * np.pi * _STEEL)) ** (2.0 / 3.0)
    sizes, axes = np.linalg.eigh(0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia)
    moments = (axes * np.maximum(sizes, least)) @ axes.T
    return Inertia(link.mass, link.com, np.trace(moments) * np.eye(3) - moments)


def _guessed(model: RobotModel, link: int) -> Inertia:
    """Assumed ball for a link without CAD."""
    masses = [other.mass for other in model.inertias if other.mass > 0]
    mass = float(np.mean(masses)) if masses else _UNKNOWN_MASS
    lengths = [float(np.linalg.norm(joint.translation)) for joint in model.joints if joint.parent == link]
    radius = max(max(lengths, default=0.0) / 2.0, _UNKNOWN_RADIUS)
    return Inertia(mass, np.zeros(3), 0.4 * mass * radius**2 * np.eye(3))


def _drives(observation: Equations, system: TriangularFactor) -> Iterator[Cone]:
    model, names = observation.model, observation.names
    torque, sizes = float(np.linalg.norm(system.right)) or 1.0, np.linalg.norm(system.matrix, axis=0)
    largest: dict[str, float] = {}
    for name, size in zip(names, sizes, strict=True):
        largest[_kind(name)] = max(largest.get(_kind(name), 0.0), float(size))
    seen = {name for name, size in zip(names, sizes, strict=True) if size > _SILENT * largest[_kind(name)]}

    def reference(name: str) -> tuple[float, float]:
        """Reference size and relative standard deviation."""
        known = model.values.get(name, math.nan)
        if known > 0:
            return known, model.prior.rotor_inertia if name.endswith(".rotor_inertia") else _UNKNOWN_STD
        return torque / largest[_kind(name)], _UNKNOWN_STD

    for key in ("rotor_inertia", "viscous"):
        for joints, shared in _groups(model, [f"{joint}.{key}" in seen for joint in model.joint_names]):
            own = [f"{joint}.{key}" for joint in joints]
            known = [reference(name) for name in own]
            column_indices, basis = (
                [names.index(name) for name in own],
                [np.diag(row) for row in np.eye(len(own))],
            )
            for motor, joint, ratio in shared:
                if f"{motor}.{key}_at_{joint}" in seen:
                    column_indices.append(names.index(f"{motor}.{key}_at_{joint}"))
                    places = np.eye(len(own))[[joints.index(motor), joints.index(joint)]]
                    basis.append(ratio * (np.outer(*places) + np.outer(*places[::-1])))
            size, std = np.diag([size for size, _ in known]), max(std for _, std in known)
            yield Cone(np.array(column_indices), np.array(basis), size, _DRIVE_FLOOR, std)
    for name in names:
        key = _kind(name)
        positive = key in ("coulomb", "stiffness", "damping") or key.startswith("coulomb_at_")
        if name in seen and positive:
            yield _scalar(names.index(name), reference(name)[0], _DRIVE_FLOOR, _UNKNOWN_STD)


def _groups(model: RobotModel, seen: list[bool]) -> Iterator[tuple[list[str], list[tuple[str, str, float]]]]:
    """Joints in `seen`, grouped by couplings, with those couplings (motor, joint, ratio)."""
    groups = [[name] for name, there in zip(model.joint_names, seen, strict=True) if there]
    for entry in model.config.drives.coupling:
        ends = [group for group in groups if entry.motor in group or entry.joint in group]
        if len(ends) == 2:
            groups = [group for group in groups if group not in ends] + [ends[0] + ends[1]]
    for group in groups:
        inside = [
            (entry.motor, entry.joint, entry.ratio)
            for entry in model.config.drives.coupling
            if entry.motor in group and entry.joint in group
        ]
        yield group, inside


def _kind(name: str) -> str:
    return name.rpartition(".")[2]


def _scalar(member: int, reference: float, floor: float, std: float, *, sign: float = 1.0) -> Cone:
    """Constraint `sign` times one parameter above `floor` times its reference."""
    return Cone(np.array([member]), np.full((1, 1, 1), sign), np.array([[reference]]), floor, std)
