"""Base parameters: the identifiable combinations of dynamic parameters (Gautier 1991)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.inverse_model.independent_inertials import random_states, scale_by_kind
from flexcal.dynamics.inverse_model.observation import Observation
from flexcal.dynamics.signals import ArmSide, Motion
from flexcal.estimation import Identifiability, analyse

_KEPT_FIRST = ("Izz", "Ixx", "Ixy", "Ixz", "Iyz", "Iyy", "mc_x", "mc_y", "mc_z", "mass")
"""Order in which parameters of a link are preferably kept: mass and entries along the axis are regrouped first."""
_SAMPLES_PER_PARAMETER = 3
_TILT = 1e-10
"""Tilts of bearings, rad, at the random states: negligible, as real ones are, so that columns proportional to tilts and their
accelerations do not raise the rank; they are below noise and would bias the stiffness.
"""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """The base parameters of an observation: `identifiability` names its kept columns and what absorbs the others."""

    identifiability: Identifiability

    @property
    def rank(self) -> int:
        """Structural rank: the number of base parameters."""
        return self.identifiability.rank

    @property
    def expressions(self) -> tuple[str, ...]:
        """Base parameters as expressions, as "link_1.Izz + joint_1.rotor_inertia + 0.0506 link_3.mass"."""
        return tuple(
            _written(self.identifiability.names[kept], row, self.identifiability.names)
            for kept, row in zip(self.identifiability.kept, self.identifiability.regrouping, strict=True)
        )

    @classmethod
    def of(cls, observation: Observation) -> BaseParameters:
        """By rank-revealing QR of the observation at random states, the same in every run.

        Columns are tried in a fixed order, so that the choice depends on nothing but the robot: link by link from the base, inertia
        before first moment before mass, then rotor inertias, then the other terms.
        """
        model, names = observation.model, observation.names
        samples = _SAMPLES_PER_PARAMETER * len(names)
        q, dq, ddq = random_states(model, samples)
        x, y, arm = (ArmSide(*np.roll((q, dq, ddq), shift, axis=1)) for shift in (3, 2, 1))
        small = (ArmSide(_TILT * side.q, _TILT * side.dq, _TILT * side.ddq) for side in (x, y))
        arm = replace(arm, tilts=(next(small), next(small)))
        columns = observation.columns(Motion(np.arange(samples), q, dq, ddq, np.zeros_like(q), arm))
        matrix = np.zeros((len(columns) * samples, len(names)))
        for k, (block, column_indices) in enumerate(zip(columns, observation.column_indices, strict=True)):
            matrix[k * samples : (k + 1) * samples, column_indices] = block.T
        prefer = [f"{bearing.name(model)}.stiffness" for bearing in observation.bearings]
        prefer += [f"{joint.link}.{key}" for joint in model.joints for key in _KEPT_FIRST]
        prefer += [name for name in names if name not in set(prefer)]
        scale = scale_by_kind(matrix, names)
        for bearing in observation.bearings:  # as small as the tilts
            own = [names.index(f"{bearing.name(model)}.{key}") for key in ("stiffness", "damping")]
            scale[own] = 1.0 / np.linalg.norm(matrix[:, own], axis=0)
        return cls(analyse(matrix, names, scale=scale, prefer=prefer))


def _written(kept: str, row: np.ndarray, names: tuple[str, ...]) -> str:
    text = kept
    for name, coefficient in zip(names, row, strict=True):
        if name == kept or abs(coefficient) < 1e-9:
            continue
        size = "" if np.isclose(abs(coefficient), 1.0, rtol=1e-9) else f"{abs(coefficient):.6g} "
        text += f" {'-' if coefficient < 0 else '+'} {size}{name}"
    return text
